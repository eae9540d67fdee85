/// The cost profile `host`: what the stages cost on the machine that this program runs on.
#pragma once

#include <array>
#include <string>

#include "core/executive/cost_profile.hpp"
#include "governor/models/latency_model.hpp"

namespace roborun::app {

struct Profile {
  core::CostProfile costs{};
  std::array<governor::LatencyModel, 3> model{};  ///< Map, export, planner: what the governor predicts with.
};

/// The authors' machine; the governor's model is the profile itself.
[[nodiscard]] Profile paper();

/// Seconds per unit of work of each stage, and per volume at each precision, times `factor`: a slower board
/// is a factor above 1. Measured once (about a second) on environment 14, and kept in `path`, because a run
/// must repeat: the same file gives the same state_hash. A missing file is measured and written, which `note`
/// says; one that cannot be written is used for this run only. Throws sitl::InputError for a malformed file.
[[nodiscard]] Profile host(const std::string& path, double factor, std::string& note);
/// $XDG_CACHE_HOME/roborun/host.toml, or below $HOME/.cache, or in the working folder.
[[nodiscard]] std::string default_host_path();

}  // namespace roborun::app
