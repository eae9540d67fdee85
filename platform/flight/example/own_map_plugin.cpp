/// The same class for the program that ships: roborun fly --map plugin:./own_map.so
#include "own_map.hpp"
#include "platform/board/plugin.hpp"

ROBORUN_PLUGIN_MAP(example::VoxelMap)
