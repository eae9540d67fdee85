#include "platform/input/stop_signal.hpp"

namespace roborun::input {
namespace {

volatile std::sig_atomic_t stop = 0;

}  // namespace

StopOnSignal::StopOnSignal() {
  stop = 0;
  struct sigaction action {};
  action.sa_handler = [](int) { stop = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  (void)sigaction(SIGINT, &action, &int_);
  (void)sigaction(SIGTERM, &action, &term_);
}

StopOnSignal::~StopOnSignal() {
  (void)sigaction(SIGINT, &int_, nullptr);
  (void)sigaction(SIGTERM, &term_, nullptr);
}

bool StopOnSignal::requested() noexcept { return stop != 0; }

}  // namespace roborun::input
