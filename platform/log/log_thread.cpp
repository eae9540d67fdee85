#include "platform/log/log_thread.hpp"

#include <chrono>

namespace roborun::log {
namespace {

/// A quarter of the time that the smallest ring of the flight lane lasts is 1.6 s: this is often enough.
constexpr std::chrono::milliseconds kNap{50};

}  // namespace

LogThread::LogThread(FlightLog& log) : log_(log), thread_([this] { run(); }) {}

LogThread::~LogThread() { stop(); }

void LogThread::drain() noexcept {
  while (states_.pop(state_)) log_.write(state_);
  while (failsafe_.pop(failsafe_entry_)) log_.write(failsafe_entry_);
  while (decisions_.pop(decision_)) log_.write(decision_);
  while (slices_.pop(slice_)) log_.write(slice_);
  log_.dropped(drops());
}

void LogThread::run() noexcept {
  while (!stopping_.load(std::memory_order_acquire)) {
    drain();
    std::this_thread::sleep_for(kNap);
  }
  drain();
}

void LogThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

}  // namespace roborun::log
