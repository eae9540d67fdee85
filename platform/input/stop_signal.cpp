#include "platform/input/stop_signal.hpp"

namespace roborun::input {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};

volatile std::sig_atomic_t stop = 0;

}  // namespace

StopOnSignal::StopOnSignal() {
  stop = 0;
  struct sigaction action {};
  action.sa_handler = [](int) { stop = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (std::size_t i = 0; i < kSignals.size(); ++i) (void)sigaction(kSignals[i], &action, &before_[i]);
  if (before_.back().sa_handler == SIG_IGN) (void)sigaction(SIGHUP, &before_.back(), nullptr);
}

StopOnSignal::~StopOnSignal() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) (void)sigaction(kSignals[i], &before_[i], nullptr);
}

bool StopOnSignal::requested() noexcept { return stop != 0; }

}  // namespace roborun::input
