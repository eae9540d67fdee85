// What a page cannot have, in the place of the tree's sources: OctoMap, OMPL and zstd are no header-only libraries. A log is for the
// page alone and is not compressed; the page offers neither of the other two, and who asked for them would be refused.
#include "platform/input/input_error.hpp"
#include "platform/log/compression.hpp"
#include "platform/rt/host_identity.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"

namespace roborun {

std::unique_ptr<stages::OccupancyMap> stages::make_octomap_backend(const OctomapConfig&) noexcept {
  return nullptr;
}
std::unique_ptr<stages::Planner> stages::make_ompl_planner(std::string_view, const OmplConfig&) noexcept {
  return nullptr;
}

log::Compressor::Compressor() : context_(nullptr, nullptr) {}
std::string_view log::Compressor::run(std::string_view, int) { return {}; }
log::Decompressor::Decompressor() : context_(nullptr, nullptr) {}
void log::Decompressor::run(std::string&, std::string_view, std::size_t) {
  throw InputError("zstd is not here");
}

rt::HostIdentity rt::identify_host() { return {}; }

}  // namespace roborun
