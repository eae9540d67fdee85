/// One lane of the cyclic executive: runs its slots of the frame table, charges each its time, and reacts to
/// overruns. It has no thread: real time calls step() from a pinned thread, lockstep from a loop.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/exchange/spsc_ring.hpp"
#include "core/executive/frame_table.hpp"
#include "core/executive/slot_statistics.hpp"
#include "firmware_if/clock.hpp"

namespace roborun::core {

class LaneExecutive;

/// What runs in the slots of a lane. Contract: run() neither blocks nor allocates in a real-time lane.
class LaneProgram {
 public:
  virtual ~LaneProgram() = default;
  virtual void run(SlotId slot, LaneExecutive& lane) noexcept = 0;
};

/// What the overruns of one lane demand of all: any thread may read, each bit belongs to one slot.
class Reactions {
 public:
  void brake(SlotId slot, bool on) noexcept;
  void stop(SlotId slot) noexcept;
  [[nodiscard]] bool braking() const noexcept { return brake_.load(std::memory_order_acquire) != 0; }
  [[nodiscard]] bool stopping() const noexcept { return stop_.load(std::memory_order_acquire) != 0; }
  /// The slot that stopped the run. Precondition: stopping().
  [[nodiscard]] SlotId stopped_by() const noexcept;

 private:
  std::atomic<std::uint32_t> brake_{0};
  std::atomic<std::uint32_t> stop_{0};
};

/// A frame, from the wake-up to its end, or a piece of it that was charged to one slot. Pieces of a lane follow
/// each other and lie within their frame, which comes after them.
struct TraceEvent {
  MonotonicTime release{};  ///< Of the frame.
  MonotonicTime begin{}, end{};
  std::uint32_t frame{};  ///< Counted from the lane's first one, modulo 2^32.
  LaneId lane{};
  SlotId slot{};  ///< Of a piece.
  bool is_frame{};
  bool
      overrun{};  ///< Piece: its slot had spent more than its budget by then. Frame: it ended after its deadline.
};
using TraceRing = SpscRing<TraceEvent, 8192>;

/// Time is charged to the slot that uses it, by wall clock, preemption included. Releases lie on a grid that
/// never shifts: a frame that runs into its successors makes them slip, they are counted and never made up
/// for. RT-safe: executive work is O(slots) a frame. One thread.
class LaneExecutive {
 public:
  /// `trace` may be null; a full one loses events, never time.
  LaneExecutive(LaneId id, const firmware_if::Clock& clock, LaneProgram& program, Reactions& reactions,
                TraceRing* trace) noexcept;

  /// `minor_frame`: the period of the flight and the decision lane in this run.
  void start(MonotonicTime first_release, Nanos minor_frame = kMinorFrame) noexcept;
  /// Of the frame in progress, or of the next one.
  [[nodiscard]] MonotonicTime release() const noexcept { return release_; }
  [[nodiscard]] bool in_frame() const noexcept { return in_frame_; }
  /// Precondition: in_frame().
  [[nodiscard]] SlotId next_slot() const noexcept { return kFrameTable[first_ + at_].id; }
  /// Runs the next slot; the first one of a frame begins it, the last one ends it.
  void step() noexcept;
  /// The thread woke up for the next frame at `now`: read as soon as it runs, so that what the executive
  /// itself does counts as its overhead and not as the kernel's jitter. Without it the first step() reads the
  /// clock.
  void wake(MonotonicTime now) noexcept {
    woke_ = now;
    awake_ = true;
  }
  void run_frame() noexcept {
    do step();
    while (in_frame_);
  }

  // For programs, during run().
  [[nodiscard]] MonotonicTime now() const noexcept { return clock_.now(); }
  [[nodiscard]] std::uint64_t frame() const noexcept { return lane_.frames; }
  /// From here on time is this slot's (of the same lane).
  void charge_to(SlotId id) noexcept;
  /// What the slot has spent in this frame until now.
  [[nodiscard]] Nanos spent(SlotId id) const noexcept;
  /// The slot's budget in this frame, if less than the table's; returns what holds (half after a degrade).
  Nanos grant(SlotId id, Nanos wanted) noexcept;
  /// What the slot worked on: kept with its longest time.
  void describe(SlotId id, const Work& work) noexcept { now_[index(id)].work = work; }
  /// Until the release after this frame. Rounded up to whole periods of the lane, at least one.
  void set_period(Nanos period) noexcept;
  /// The other slots of this frame are not run.
  void end_frame() noexcept { ending_ = true; }

  /// Any thread: the slot in which the lane hangs at `now`, kWatchdogPatience after that slot's budget was
  /// spent (its frame has not ended: nothing else has blamed it yet), or after the frame that it begins was
  /// due.
  [[nodiscard]] std::optional<SlotId> overdue(MonotonicTime now) const noexcept;

  [[nodiscard]] LaneId id() const noexcept { return id_; }
  [[nodiscard]] Reactions& reactions() const noexcept { return reactions_; }
  [[nodiscard]] const LaneStatistics& statistics() const noexcept { return lane_; }
  [[nodiscard]] const SlotStatistics& statistics(SlotId id) const noexcept { return slot_[index(id)]; }

 private:
  /// A slot in the frame in progress.
  struct Present {
    bool ran{false};
    MonotonicTime begin{};
    Nanos spent{0};
    Nanos budget{0};
    Work work{};
  };
  [[nodiscard]] std::size_t index(SlotId id) const noexcept { return static_cast<std::size_t>(id) - first_; }
  void begin_frame() noexcept;
  void finish_frame() noexcept;
  void judge(const SlotSpec& spec, const Present& present) noexcept;
  /// What passed until `now` is the charged slot's; `ends`: its piece of the trace ends with it.
  void settle(MonotonicTime now, bool ends) noexcept;
  /// Tells overdue() that `slot` is to be done by `due`.
  void expect(SlotId slot, MonotonicTime due) noexcept;

  static constexpr std::size_t kMostSlots = 8;
  static_assert(kSlotCount <= 16, "expected_ has four bits for the slot");
  LaneId id_;
  const firmware_if::Clock& clock_;
  LaneProgram& program_;
  Reactions& reactions_;
  TraceRing* trace_;
  std::size_t first_{0};
  std::size_t count_{0};

  Nanos grid_{};  ///< Of the releases.
  MonotonicTime release_{};
  MonotonicTime woke_{};
  Nanos period_{};  ///< Of this frame.
  std::size_t at_{0};
  bool in_frame_{false};
  bool awake_{false};
  bool ending_{false};
  SlotId charged_{};
  MonotonicTime mark_{};   ///< Since when time is `charged_`'s.
  MonotonicTime piece_{};  ///< Since when it is without a break.
  std::array<Present, kMostSlots> now_{};
  std::array<std::uint32_t, kMostSlots> in_a_row_{};
  std::array<bool, kMostSlots> skip_next_{};
  std::array<bool, kMostSlots> degrade_next_{};
  std::array<SlotStatistics, kMostSlots> slot_{};
  LaneStatistics lane_{};
  std::atomic<std::int64_t> expected_{0};  ///< 16 * the instant in ns + the slot.
};

}  // namespace roborun::core
