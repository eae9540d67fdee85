#include "platform/rt/lane_set.hpp"

#include "platform/rt/memory_lock.hpp"

namespace roborun::rt {
namespace {

constexpr Nanos kLeadTime{50'000'000};  // from the start of the threads to the first release

}  // namespace

LaneSet::LaneSet(const LaneSetConfig& config, const MonotonicClock& clock, core::Reactions& reactions,
                 const std::array<core::LaneProgram*, core::kLaneCount>& programs)
    : config_(config),
      clock_(clock),
      lane_{core::LaneExecutive(core::LaneId::kFlight, clock, *programs[0], reactions,
                                config.trace ? &ring_[0] : nullptr),
            core::LaneExecutive(core::LaneId::kDecision, clock, *programs[1], reactions,
                                config.trace ? &ring_[1] : nullptr),
            core::LaneExecutive(core::LaneId::kBackground, clock, *programs[2], reactions,
                                config.trace ? &ring_[2] : nullptr),
            core::LaneExecutive(core::LaneId::kWatchdog, clock, *programs[3], reactions,
                                config.trace ? &ring_[3] : nullptr)},
      thread_{LaneThread(lane_[0], clock), LaneThread(lane_[1], clock), LaneThread(lane_[2], clock),
              LaneThread(lane_[3], clock)} {}

std::string LaneSet::prepare() {
  missing_ = why_not_real_time();
  // Lanes that have to share a CPU share it by priority.
  fifo_ = why_no_priority().empty();
  if (const std::string error = lock_memory(); !error.empty()) missing_.push_back(error);
  unlock_libraries(config_.unneeded_libraries);
  if (missing_.empty() || config_.best_effort) return {};
  std::string all;
  for (const std::string& reason : missing_) all += (all.empty() ? "" : "; ") + reason;
  return all;
}

MonotonicTime LaneSet::choose_first_release() noexcept {
  const std::int64_t frames = (clock_.now().time_since_epoch() + kLeadTime) / config_.minor_frame + 1;
  return first_ = MonotonicTime{frames * config_.minor_frame};
}

std::string LaneSet::start() {
  seal_heap(config_.seal);
  for (std::size_t i = 0; i < core::kLaneCount; ++i) {
    placement_[i] = placement_of(core::kLanes[i]);
    if (!fifo_) placement_[i].priority = 0;
    // Timers that expire together are served together, each wake-up before the next: the others come between
    // the flight lane's releases, so that it waits for nobody's where CPUs are shared.
    const bool is_flight = core::kLanes[i].id == core::LaneId::kFlight;
    lane_[i].start(is_flight ? first_ : first_ + config_.minor_frame / 2, config_.minor_frame);
    if (std::string error = thread_[i].start(placement_[i], true); !error.empty()) return error;
  }
  if (!config_.confine) return {};
  const std::string why = config_.confine();
  if (why.empty()) return {};
  missing_.push_back(why);
  return config_.best_effort ? std::string() : why + " (--best-effort runs on without)";
}

void LaneSet::stop() noexcept {
  for (LaneThread& thread : thread_) thread.request_stop();
  for (LaneThread& thread : thread_) thread.join();
  seal_heap(HeapSeal::kOpen);
  unlock_memory();
}

std::uint64_t LaneSet::events_lost() const noexcept {
  std::uint64_t sum = 0;
  for (const core::TraceRing& ring : ring_) sum += ring.dropped();
  return sum;
}

void LaneSet::drain_trace(std::vector<core::TraceEvent>& events) {
  core::TraceEvent event;
  for (core::TraceRing& ring : ring_) {
    while (ring.pop(event)) events.push_back(event);
  }
}

}  // namespace roborun::rt
