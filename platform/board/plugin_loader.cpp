#include "platform/board/plugin_loader.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include "platform/board/plugin_abi.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::board {
namespace {

constexpr const char* kPrefix = "plugin:";

/// Pointers to objects and functions are of one kind to POSIX, not to C++.
template <typename Entry>
Entry entry(void* library, const char* name) noexcept {
  return reinterpret_cast<Entry>(dlsym(library, name));
}

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw InputError(fmt::format("{}: {}", name, why));
}

void check_abi(const std::string& name, const PluginAbi* abi) {
  if (abi == nullptr) refuse(name, "says no ABI version");
  if (abi->version != kProgramAbi.version)
    refuse(name,
           fmt::format("of plugin ABI {}: must be {}, that of this program: build it against its headers",
                       abi->version, kProgramAbi.version));
  if (abi->layout != kProgramAbi.layout)
    refuse(name,
           fmt::format("its data has another layout (built with {}): must be built as this program ({})",
                       abi->build, kProgramAbi.build));
}

/// Loads, and checks that program and plugin mean the same before anything of it is called.
void* open(const std::string& name) {
  std::string file = name.substr(std::string(kPrefix).size());
  if (file.empty()) refuse(name, "no file: must be plugin:FILE.so");
  // Without a slash dlopen would search the folders of the system.
  if (file.find('/') == std::string::npos) file = "./" + file;
  // Lazily at first: what a plugin for another program wants may not be here.
  void* library = dlopen(file.c_str(), RTLD_LAZY | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) refuse(name, fmt::format("cannot be loaded: {}", dlerror()));
  const auto abi = entry<PluginAbiEntry>(library, kPluginAbiEntry);
  if (abi == nullptr)
    refuse(name, fmt::format("no plugin: has no {}(), see platform/board/plugin.hpp", kPluginAbiEntry));
  check_abi(name, abi());
  if (dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL) == nullptr)
    refuse(name, fmt::format("cannot be loaded: {}", dlerror()));
  return library;
}

template <typename Part, typename Entry>
std::unique_ptr<Part> load(const std::string& name, const char* symbol, const char* what,
                           const PartRequest& request) {
  const auto make = entry<Entry>(open(name), symbol);
  if (make == nullptr) refuse(name, fmt::format("holds no {}: has no {}()", what, symbol));
  std::unique_ptr<Part> part(make(&request, detail::assertion_handler.load(std::memory_order_acquire)));
  if (part == nullptr) refuse(name, fmt::format("could not make its {} for this flight", what));
  return part;
}

}  // namespace

bool is_plugin(const std::string& name) noexcept { return name.rfind(kPrefix, 0) == 0; }

std::unique_ptr<stages::OccupancyMap> load_map(const std::string& name, const PartRequest& request) {
  return load<stages::OccupancyMap, PluginMapEntry>(name, kPluginMapEntry, "map", request);
}

std::unique_ptr<stages::Planner> load_planner(const std::string& name, const PartRequest& request) {
  return load<stages::Planner, PluginPlannerEntry>(name, kPluginPlannerEntry, "planner", request);
}

std::unique_ptr<stages::Ways> load_ways(const std::string& name, const PartRequest& request) {
  return load<stages::Ways, PluginWaysEntry>(name, kPluginWaysEntry, "memory of ways", request);
}

}  // namespace roborun::board
