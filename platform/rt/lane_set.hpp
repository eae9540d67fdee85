/// All lanes of the frame table on their threads: placement, locked memory, sealed heap, first release,
/// trace, stop. What runs in them is the caller's.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "core/executive/lane_executive.hpp"
#include "platform/rt/heap_seal.hpp"
#include "platform/rt/lane_thread.hpp"
#include "platform/rt/monotonic_clock.hpp"

namespace roborun::rt {

struct LaneSetConfig {
  Nanos minor_frame{core::kMinorFrame};
  HeapSeal seal{HeapSeal::kCount};
  bool best_effort{false};  ///< Runs without what is missing.
  /// Called once all threads run: confine(), which says what is missing. May be empty.
  std::function<std::string()> confine{};
  bool trace{false};  ///< Every frame and slot is kept for drain_trace(), which is to be called often.
  /// Shared libraries whose pages are not needed locked: names as of unlock_libraries().
  std::span<const char* const> unneeded_libraries{};
};

class LaneSet {
 public:
  /// `programs` in the order of core::kLanes; they, the clock and the reactions must outlive the set.
  LaneSet(const LaneSetConfig& config, const MonotonicClock& clock, core::Reactions& reactions,
          const std::array<core::LaneProgram*, core::kLaneCount>& programs);
  LaneSet(const LaneSet&) = delete;
  LaneSet& operator=(const LaneSet&) = delete;

  /// Locks the memory. Empty if all is there that real time needs, or best_effort is on; otherwise one line
  /// that names all that is missing.
  [[nodiscard]] std::string prepare();
  /// What prepare() and start() found missing, one line each.
  [[nodiscard]] const std::vector<std::string>& missing() const noexcept { return missing_; }
  /// The instant of the flight lane's first release: in whole minor frames, far enough ahead for all threads
  /// to be there.
  [[nodiscard]] MonotonicTime choose_first_release() noexcept;
  /// Seals the heap, starts all threads and confines them. Empty, or why one of them could not be started or, without
  /// best_effort, confined: then stop().
  [[nodiscard]] std::string start();
  /// Asks all lanes to end, waits for them, opens the heap and unlocks the memory. What happens after it is
  /// not watched. More than once is harmless.
  void stop() noexcept;
  /// Appends what the lanes traced since the call before.
  void drain_trace(std::vector<core::TraceEvent>& events);
  /// Events that came while nobody drained for too long; never decreases.
  [[nodiscard]] std::uint64_t events_lost() const noexcept;

  [[nodiscard]] const core::LaneExecutive& lane(core::LaneId id) const noexcept { return lane_[index(id)]; }
  [[nodiscard]] core::LaneExecutive& lane(core::LaneId id) noexcept { return lane_[index(id)]; }
  [[nodiscard]] const LaneThread& thread(core::LaneId id) const noexcept { return thread_[index(id)]; }
  [[nodiscard]] const Placement& placement(core::LaneId id) const noexcept { return placement_[index(id)]; }

 private:
  static constexpr std::size_t index(core::LaneId id) noexcept { return static_cast<std::size_t>(id); }

  LaneSetConfig config_;
  const MonotonicClock& clock_;
  std::vector<std::string> missing_;
  MonotonicTime first_{};
  bool fifo_{false};
  std::array<core::TraceRing, core::kLaneCount> ring_;
  std::array<core::LaneExecutive, core::kLaneCount> lane_;
  std::array<LaneThread, core::kLaneCount> thread_;
  std::array<Placement, core::kLaneCount> placement_{};
};

}  // namespace roborun::rt
