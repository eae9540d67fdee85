/// The same class for the program that ships: roborun fly --planner plugin:./own_planner.so
#include "own_planner.hpp"
#include "platform/board/plugin.hpp"

ROBORUN_PLUGIN_PLANNER(example::StraightPlanner)
