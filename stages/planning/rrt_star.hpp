/// RRT* in known free space, in fixed memory. Source: Karaman and Frazzoli, "Sampling-based algorithms for
/// optimal motion planning" (2011); informed rejection after Gammell et al. (2014).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/precision.hpp"
#include "core/random/counter_rng.hpp"
#include "stages/planning/planner.hpp"

namespace roborun::stages {

/// The tree grows from the start through known free space only. The goal is most often far outside, so the
/// answer is the node of least (cost to come + kUnknownWeight * straight distance to the goal + up to 10 m if
/// a surface stands in the way there), ties by index, then shortened. Open space costs nothing: if the
/// straight way to the goal (or to the horizon) is free, that is the answer.
class RrtStar final : public Planner {
 public:
  struct Config {
    std::size_t max_nodes{1500};      ///< [16, 100000]
    std::uint32_t max_samples{4000};  ///< A bound on the iterations. [16, 1000000]
    double step_m{6.0};               ///< Longest edge: the gap of the reference environments. [0.5, 50]
    double rewire_m{8.0};             ///< Largest neighbourhood. [0.5, 50]
    /// Samples without an improvement of 1 % after which the answer is taken. [16, 1000000]
    std::uint32_t patience{250};
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool ok = max_nodes >= 16 && max_nodes <= 100000 && max_samples >= 16 && max_samples <= 1000000 &&
                      step_m >= 0.5 && step_m <= 50 && rewire_m >= 0.5 && rewire_m <= 50 && patience >= 16 &&
                      patience <= 1000000;
      return ok ? Status::kOk : Status::kInvalidArgument;
    }
  };
  [[nodiscard]] static constexpr std::size_t arena_bytes(const Config& config) noexcept {
    return config.max_nodes * sizeof(Node) + kVisited * sizeof(std::uint64_t) + 64;
  }
  /// Precondition: config.validate() is kOk. Check arena.exhausted() afterwards.
  RrtStar(const Config& config, core::Arena& arena) noexcept;

  /// Explored volume: distinct 4.8 m cells that hold a node, times their size.
  [[nodiscard]] Status plan(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                            PlanResult& result) noexcept override;

 private:
  static constexpr std::size_t kVisited = 8192;
  static constexpr std::size_t kNeighbours = 12;
  struct Node {
    Vector3 p_W = Vector3::Zero();
    double cost_m{};
    std::int32_t parent{-1};
  };
  struct Neighbour {
    std::int32_t node;
    double distance_m;
  };

  [[nodiscard]] Vector3 sample(const PlanRequest& request, core::CounterRng& rng) const noexcept;
  void try_extend(const PlanRequest& request, const MapView& view, const Vector3& sample_W,
                  core::Work& work) noexcept;
  [[nodiscard]] std::size_t neighbours_of(const Vector3& p_W, double radius_m,
                                          std::array<Neighbour, kNeighbours>& found) const noexcept;
  void add_node(const Vector3& p_W, std::int32_t parent, double cost_m, core::Work& work) noexcept;
  [[nodiscard]] double promise_m(const Node& node, const Vector3& goal_W) const noexcept;
  /// What the first surface on the straight way on to the goal will cost, 0 if none is known within 12 m.
  [[nodiscard]] double detour_m(const PlanRequest& request, const MapView& view, const Vector3& p_W,
                                std::uint64_t& lookups) const noexcept;
  void extract(const PlanRequest& request, const MapView& view, std::int32_t node,
               PlanResult& result) noexcept;
  [[nodiscard]] Status escape(const PlanRequest& request, const MapView& view,
                              PlanResult& result) const noexcept;

  Config config_;
  std::span<Node> node_;
  core::PoolRecord& node_pool_;
  std::span<std::uint64_t> visited_;
  std::size_t count_{0};
};

}  // namespace roborun::stages
