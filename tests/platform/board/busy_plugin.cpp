/// A planner that plans ROBORUN_REPEATS times and says ROBORUN_SAYS of the work that it did.
#include "platform/board/plugin.hpp"
#include "tests/support/busy_planner.hpp"

namespace roborun::board {
namespace {

class BusyPlugin final : public test::BusyPlanner {
 public:
  BusyPlugin() noexcept : BusyPlanner(ROBORUN_REPEATS, ROBORUN_SAYS) {}
};

}  // namespace
}  // namespace roborun::board

ROBORUN_PLUGIN_PLANNER(roborun::board::BusyPlugin)
