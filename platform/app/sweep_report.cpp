#include "platform/app/sweep_run.hpp"
namespace roborun::app {
void write_sweep_report(const SweepStore&) {}
}  // namespace roborun::app
