/// Plugins that must be refused: ROBORUN_BAD_VERSION and ROBORUN_BAD_LAYOUT say of what ABI, and the entry fails.
#include <cstdint>

#include "platform/board/plugin_abi.hpp"

namespace {

const roborun::board::PluginAbi kAbi{ROBORUN_BAD_VERSION, ROBORUN_BAD_LAYOUT, "a strange compiler"};

}  // namespace

extern "C" __attribute__((visibility("default"))) const roborun::board::PluginAbi* roborun_plugin_abi() {
  return &kAbi;
}
extern "C" __attribute__((visibility("default"))) void* roborun_make_planner(const void*) { return nullptr; }
