#include "core/executive/lane_executive.hpp"

#include <algorithm>
#include <bit>

namespace roborun::core {
namespace {

constexpr std::uint32_t bit(SlotId slot) noexcept { return 1U << static_cast<std::uint32_t>(slot); }

}  // namespace

void Reactions::brake(SlotId slot, bool on) noexcept {
  if (on)
    brake_.fetch_or(bit(slot), std::memory_order_acq_rel);
  else
    brake_.fetch_and(~bit(slot), std::memory_order_acq_rel);
}

void Reactions::stop(SlotId slot) noexcept {
  std::uint32_t none = 0;
  (void)stop_.compare_exchange_strong(none, bit(slot), std::memory_order_acq_rel);
}

SlotId Reactions::stopped_by() const noexcept {
  return static_cast<SlotId>(std::countr_zero(stop_.load(std::memory_order_acquire)));
}

LaneExecutive::LaneExecutive(LaneId id, const firmware_if::Clock& clock, LaneProgram& program,
                             Reactions& reactions, TraceRing* trace) noexcept
    : id_(id), clock_(clock), program_(program), reactions_(reactions), trace_(trace) {
  while (kFrameTable[first_].lane != id) ++first_;
  while (first_ + count_ < kSlotCount && kFrameTable[first_ + count_].lane == id) ++count_;
  start(MonotonicTime{});
}

void LaneExecutive::start(MonotonicTime first_release, Nanos minor_frame) noexcept {
  grid_ = lane(id_).period == kMinorFrame ? minor_frame : lane(id_).period;
  release_ = first_release;
  in_frame_ = false;
  expect(kFrameTable[first_].id, release_);
}

void LaneExecutive::expect(SlotId slot, MonotonicTime due) noexcept {
  expected_.store(16 * due.time_since_epoch().count() + static_cast<std::int64_t>(slot),
                  std::memory_order_release);
}

std::optional<SlotId> LaneExecutive::overdue(MonotonicTime now) const noexcept {
  const std::int64_t expected = expected_.load(std::memory_order_acquire);
  if (now <= MonotonicTime{Nanos{expected / 16}} + kWatchdogPatience) return std::nullopt;
  return static_cast<SlotId>(expected % 16);
}

void LaneExecutive::begin_frame() noexcept {
  if (!awake_) woke_ = clock_.now();
  awake_ = false;
  lane_.jitter.add(woke_ - release_);
  period_ = grid_;
  at_ = 0;
  in_frame_ = true;
  ending_ = false;
  for (std::size_t i = 0; i < count_; ++i) {
    now_[i] = {};
    now_[i].budget = kFrameTable[first_ + i].budget;
    if (degrade_next_[i]) now_[i].budget /= 2;
  }
  charged_ = kFrameTable[first_].id;
  mark_ = piece_ = woke_;
}

void LaneExecutive::settle(MonotonicTime now, bool ends) noexcept {
  Present& present = now_[index(charged_)];
  present.spent += now - mark_;
  mark_ = now;
  if (!ends) return;
  if (trace_ != nullptr && present.ran)
    trace_->push({release_, piece_, now, static_cast<std::uint32_t>(lane_.frames), id_, charged_, false,
                  present.spent > present.budget});
  piece_ = now;
}

void LaneExecutive::charge_to(SlotId id) noexcept {
  const MonotonicTime now = clock_.now();
  settle(now, id != charged_);
  charged_ = id;
  Present& present = now_[index(id)];
  if (!present.ran) present.begin = now;
  present.ran = true;
  expect(id, now + present.budget - present.spent);
}

Nanos LaneExecutive::spent(SlotId id) const noexcept {
  return now_[index(id)].spent + (id == charged_ ? clock_.now() - mark_ : Nanos{0});
}

Nanos LaneExecutive::grant(SlotId id, Nanos wanted) noexcept {
  Present& present = now_[index(id)];
  const Nanos cut = degrade_next_[index(id)] ? wanted / 2 : wanted;
  present.budget = std::max(std::min(present.budget, cut), Nanos{1});
  if (id == charged_) expect(id, mark_ + present.budget - present.spent);
  return present.budget;
}

void LaneExecutive::set_period(Nanos period) noexcept {
  const std::int64_t whole = (period.count() + grid_.count() - 1) / grid_.count();
  period_ = std::max<std::int64_t>(whole, 1) * grid_;
}

void LaneExecutive::step() noexcept {
  if (!in_frame_) begin_frame();
  if (skip_next_[at_]) {
    skip_next_[at_] = false;
    ++slot_[at_].skipped;
  } else {
    const SlotId id = kFrameTable[first_ + at_].id;
    charge_to(id);
    program_.run(id, *this);
  }
  ++at_;
  if (at_ == count_ || ending_) finish_frame();
}

void LaneExecutive::judge(const SlotSpec& spec, const Present& present) noexcept {
  const std::size_t i = index(spec.id);
  SlotStatistics& s = slot_[i];
  if (present.spent > s.time.max()) s.longest = {lane_.frames, present.begin, present.work};
  s.time.add(present.spent);
  s.maxima.add(present.spent);
  const double margin_ratio =
      1.0 - static_cast<double>(present.spent.count()) / static_cast<double>(present.budget.count());
  if (s.time.count() == 1 || margin_ratio < s.margin_ratio) {
    s.margin_ratio = margin_ratio;
    s.budget = present.budget;
  }
  const bool overrun = present.spent > present.budget;
  degrade_next_[i] = false;
  if (!overrun) {
    if (spec.on_overrun == OverrunPolicy::kBrake && in_a_row_[i] >= spec.overruns_to_act)
      reactions_.brake(spec.id, false);
    in_a_row_[i] = 0;
    return;
  }
  ++s.overruns;
  if (++in_a_row_[i] < spec.overruns_to_act) return;
  ++s.reactions;
  switch (spec.on_overrun) {
    case OverrunPolicy::kSkip:
      skip_next_[i] = true;
      in_a_row_[i] = 0;
      break;
    case OverrunPolicy::kDegrade:
      degrade_next_[i] = true;
      break;
    case OverrunPolicy::kBrake:
      reactions_.brake(spec.id, true);
      break;
    case OverrunPolicy::kStop:
      reactions_.stop(spec.id);
      break;
  }
}

void LaneExecutive::finish_frame() noexcept {
  settle(clock_.now(), true);
  Nanos of_stages{0};
  for (std::size_t i = 0; i < count_; ++i) {
    if (!now_[i].ran) continue;
    const SlotSpec& spec = kFrameTable[first_ + i];
    judge(spec, now_[i]);
    if (spec.is_stage) of_stages += now_[i].spent;
  }
  in_frame_ = false;

  const MonotonicTime due = release_ + period_;
  const MonotonicTime end = clock_.now();
  if (trace_ != nullptr)
    trace_->push(
        {release_, woke_, end, static_cast<std::uint32_t>(lane_.frames), id_, charged_, true, end > due});
  ++lane_.frames;
  if (end > due) ++lane_.deadline_misses;
  lane_.response.add(end - release_);
  lane_.overhead.add((end - woke_) - of_stages);
  MonotonicTime next = due;
  if (end > due) {
    const std::int64_t late = ((end - due).count() + grid_.count() - 1) / grid_.count();
    lane_.slips += static_cast<std::uint64_t>(late);
    next += late * grid_;
  }
  release_ = next;
  expect(kFrameTable[first_].id, release_);
}

}  // namespace roborun::core
