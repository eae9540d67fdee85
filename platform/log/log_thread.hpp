/// Between the lanes of a flight and its log: rings that never make a lane wait, and a thread that formats, compresses and writes.
#pragma once

#include <atomic>
#include <thread>

#include "core/exchange/spsc_ring.hpp"
#include "platform/log/flight_log.hpp"

namespace roborun::log {

/// write() is RT-safe: O(1), a copy of the record, no allocation, no lock, no system call. A full ring drops the record and counts
/// it; the count is a message of the log. States and failsafe entries are of one thread (the flight lane), decisions and slices of
/// another one. About 250 kB.
class LogThread final : public LogSink {
 public:
  /// `log` is the thread's alone until stop().
  explicit LogThread(FlightLog& log);
  ~LogThread() override;
  LogThread(const LogThread&) = delete;
  LogThread& operator=(const LogThread&) = delete;

  void write(const StateRecord& record) noexcept override { (void)states_.push(record); }
  void write(const FailsafeEntry& entry) noexcept override { (void)failsafe_.push(entry); }
  void write(const DecisionEntry& entry) noexcept override { (void)decisions_.push(entry); }
  void write(const MapSlice& slice) noexcept override { (void)slices_.push(slice); }

  /// Writes what is in the rings and ends the thread. More than once is harmless.
  void stop() noexcept;
  [[nodiscard]] RingDrops drops() const noexcept {
    return {states_.dropped() + failsafe_.dropped(), decisions_.dropped(), slices_.dropped()};
  }

 private:
  void run() noexcept;
  void drain() noexcept;

  FlightLog& log_;
  core::SpscRing<StateRecord, 256> states_;  ///< Six seconds.
  core::SpscRing<FailsafeEntry, 16> failsafe_;
  core::SpscRing<DecisionEntry, 16> decisions_;
  core::SpscRing<MapSlice, 4> slices_;
  // What is taken out.
  StateRecord state_;
  FailsafeEntry failsafe_entry_;
  DecisionEntry decision_;
  MapSlice slice_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace roborun::log
