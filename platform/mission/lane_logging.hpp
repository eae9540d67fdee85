/// What the lanes of a flight on real time say to its log.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "core/executive/lane_executive.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/log/log_records.hpp"
#include "platform/mission/flight_records.hpp"

namespace roborun::mission {

/// The flight lane's part. RT-safe.
class LaneLog {
 public:
  /// Before the lanes start. Times of the log count from `start`.
  void log_to(log::LogSink& sink, MonotonicTime start) noexcept {
    log_ = &sink;
    start_ = next_state_ = start;
  }
  /// At the end of a minor frame. Without a log it does nothing. `true_p_W`: in a simulator; else null.
  void frame_done(flight::FlightSystem& system, MonotonicTime now, bool has_motors,
                  const Vector3* true_p_W = nullptr) noexcept {
    if (log_ == nullptr) return;
    const std::span<const flight::FailsafeEvent> events = system.pilot().events();
    for (; told_events_ < events.size(); ++told_events_)
      log_->write(failsafe_entry(events[told_events_], start_));
    if (now < next_state_) return;
    next_state_ = now + kStatePeriod;
    log::StateRecord record = state_record(system, now, start_, has_motors);
    record.has_truth = true_p_W != nullptr;
    if (record.has_truth) record.true_p_W = log::numbers_of(*true_p_W);
    log_->write(record);
  }

 private:
  log::LogSink* log_{nullptr};
  MonotonicTime start_{}, next_state_{};
  std::size_t told_events_{0};
};

/// The decision lane's part. RT-safe.
class DecisionLog {
 public:
  void log_to(log::LogSink& sink, MonotonicTime start, const PrecisionLattice& lattice) noexcept {
    log_ = &sink;
    start_ = next_slice_ = start;
    lattice_ = lattice;
  }
  /// After the slot that hands a decision over; nothing if there is no new one. `p_WB`, `speed_mps`: where the vehicle is now.
  void handed_over(flight::FlightSystem& system, MonotonicTime now, const log::Numbers3& p_WB,
                   double speed_mps) noexcept {
    if (log_ == nullptr) return;
    const flight::DecisionProgram& program = system.decision_program();
    if (program.decisions() == told_) return;
    told_ = program.decisions();
    log::DecisionEntry entry = decision_entry(system, program.output(), lattice_, told_, now, start_);
    entry.p_WB = p_WB;
    entry.speed_mps = speed_mps;
    log_->write(entry);
    if (now < next_slice_) return;
    next_slice_ = now + kSlicePeriod;
    // At most 1,024 blocks once a second, within the 5 ms of this slot: 0.74 ms at most in an audit on a machine with a load of 8 on
    // two cores, 0.4 us without the log. Lockstep charges nothing: a log must not change the flight.
    slice_.time_ns = entry.time_ns;
    fill_slice(system.map().view(), {p_WB[0], p_WB[1], p_WB[2]}, slice_);
    log_->write(slice_);
  }

 private:
  log::LogSink* log_{nullptr};
  MonotonicTime start_{}, next_slice_{};
  PrecisionLattice lattice_{};
  std::uint64_t told_{0};
  log::MapSlice slice_;
};

}  // namespace roborun::mission
