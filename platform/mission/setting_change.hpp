/// Settings of the governor that change in flight: what `roborun replay --what-if` asks for.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "firmware_if/time.hpp"
#include "governor/policy/governor.hpp"
#include "platform/board/backends.hpp"

namespace roborun::mission {

/// Keys of kGovernorKeys with their values from then on.
struct SettingChange {
  double at_s{std::numeric_limits<double>::infinity()};
  std::vector<std::pair<std::string, double>> to{};
  [[nodiscard]] bool empty() const noexcept { return to.empty(); }
  /// For a decision that begins now.
  [[nodiscard]] bool is_due(MonotonicTime now) const noexcept {
    return seconds(now.time_since_epoch()) >= at_s;
  }
};

/// A number of the governor that may change between two decisions.
struct GovernorKey {
  const char* key;
  double (*get)(const governor::GovernorConfig&);
  void (*set)(governor::GovernorConfig&, double);
  double low, high;  ///< Both allowed.
  const char* text;
};

// clang-format off
inline constexpr std::array<GovernorKey, 8> kGovernorKeys = [] {
  using G = governor::GovernorConfig;
  return std::array<GovernorKey, 8>{{
    {"flight.v_max_mps", [](const G& g) { return g.v_max_mps; }, [](G& g, double v) { g.v_max_mps = v; },
     0.5, 30, "fastest flight of the design aware, at most the vehicle's own"},
    {"governor.shortest_s", [](const G& g) { return seconds(g.policy.shortest); },
     [](G& g, double v) { g.policy.shortest = from_seconds(v); }, 0.01, 15, "no decision is shorter"},
    {"governor.longest_s", [](const G& g) { return seconds(g.policy.longest); },
     [](G& g, double v) { g.policy.longest = from_seconds(v); }, 0.01, 15, "no decision is longer, unless precision takes longer"},
    {"governor.decisions_per_budget", [](const G& g) { return g.policy.decisions_per_budget; },
     [](G& g, double v) { g.policy.decisions_per_budget = v; }, 1, 10, "decisions that fit into a time budget"},
    {"governor.reserve_ratio", [](const G& g) { return g.policy.reserve_ratio; },
     [](G& g, double v) { g.policy.reserve_ratio = v; }, 0, 0.5, "share of a deadline that is not planned for"},
    {"governor.cells_to_obstacle", [](const G& g) { return g.policy.cells_to_obstacle; },
     [](G& g, double v) { g.policy.cells_to_obstacle = v; }, 1, 100, "cells to the nearest obstacle at least: more is finer"},
    {"governor.planner_share", [](const G& g) { return g.policy.planner_share; },
     [](G& g, double v) { g.policy.planner_share = v; }, 0.01, 1, "of the perceived space, what a plan explores at most"},
    {"governor.near_goal_speed_mps", [](const G& g) { return g.policy.near_goal_speed_mps; },
     [](G& g, double v) { g.policy.near_goal_speed_mps = v; }, 0.1, 30, "fastest flight near the goal"},
  }};
}();
// clang-format on

/// With the change in force. Throws InputError that names the key, and says which there are.
[[nodiscard]] governor::GovernorConfig changed(const governor::GovernorConfig& config,
                                               const SettingChange& change);

/// `own`, and for a change the governor that takes it in the first decision that begins while `is_due`, which outlives the flight
/// and is of the same thread.
[[nodiscard]] board::OwnParts parts_of(board::OwnParts own, const SettingChange& change, const bool& is_due);

}  // namespace roborun::mission
