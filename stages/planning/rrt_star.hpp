/// RRT* in known free space, in fixed memory. Source: Karaman and Frazzoli, "Sampling-based algorithms for
/// optimal motion planning" (2011); informed rejection after Gammell et al. (2014).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/memory/arena.hpp"
#include "core/random/counter_rng.hpp"
#include "stages/planning/lattice_search.hpp"
#include "stages/planning/node_grid.hpp"
#include "stages/planning/planner.hpp"
#include "stages/planning/shorten.hpp"

namespace roborun::stages {

/// The tree grows from the start through known free space only. Of the tree before, the branch that was
/// taken is kept: its points are the first samples, and node, edge and parent of each are found anew in the
/// newest map, so that a branch that is blocked now ends where it is blocked. If the straight way to the goal
/// (or to the horizon) is free, that is the answer. Otherwise there are two cases:
///  - The goal lies in known free space within the horizon: straight on towards it wherever that is free and
///    sideways where it is not (the first solution), then RRT* with samples from the ellipsoid that can still
///    hold a shorter path; each better path is pulled tight and goes back into the tree.
///  - It does not: the answer is the node of least (cost to come + kUnknownWeight * straight distance to the
///    goal + up to 10 m if a surface stands in the way there), ties by index, then shortened.
class RrtStar final : public Planner {
 public:
  struct Config {
    std::size_t max_nodes{1500};      ///< [16, 100000]
    std::uint32_t max_samples{4000};  ///< A bound on the iterations. [16, 1000000]
    double step_m{6.0};               ///< Longest edge: the gap of the reference environments. [0.5, 50]
    double rewire_m{8.0};             ///< Largest neighbourhood. [0.5, 50]
    /// Samples without an improvement of 1 % after which the answer is taken. [16, 1000000]
    std::uint32_t patience{250};
    std::size_t lattice_nodes{
        1U << 20U};  ///< Of the lattice that is searched where sampling fails. [4096, 2^22]
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool ok = max_nodes >= 16 && max_nodes <= 100000 && max_samples >= 16 && max_samples <= 1000000 &&
                      step_m >= 0.5 && step_m <= 50 && rewire_m >= 0.5 && rewire_m <= 50 && patience >= 16 &&
                      patience <= 1000000 && lattice_nodes >= 4096 && lattice_nodes <= (1U << 22U);
      return ok ? Status::kOk : Status::kInvalidArgument;
    }
  };
  [[nodiscard]] static constexpr std::size_t arena_bytes(const Config& config) noexcept {
    return config.max_nodes * sizeof(Node) + kVisited * sizeof(std::uint64_t) + 128 +
           NodeGrid::arena_bytes(config.max_nodes) + LatticeSearch::arena_bytes(config.lattice_nodes);
  }
  /// Precondition, asserted: config.validate() is kOk. Check arena.exhausted() afterwards.
  RrtStar(const Config& config, core::Arena& arena) noexcept;

  /// Explored volume: distinct 4.8 m cells that hold a node, times their size. Polls the budget at every
  /// sample and every 1,024 lookups. Whatever it says, 4,096 lookups are granted to the straight way,
  /// and as many to shorten what was found.
  [[nodiscard]] Status plan(const PlanRequest& request, const MapView& view, core::StageBudget& budget,
                            PlanResult& result) noexcept override;

 private:
  static constexpr std::size_t kVisited = 8192;
  static constexpr std::size_t kNeighbours = 12;
  static constexpr double kShortEdge_m = 0.3;  ///< A node nearer than this to another adds nothing.
  struct Node {
    Vector3 p_W = Vector3::Zero();
    double cost_m{};  ///< Along the tree, always up to date.
    std::int32_t parent{-1};
    std::int32_t first_child{-1};
    std::int32_t next_sibling{-1};
  };
  using Neighbours = std::array<NodeGrid::Near, kNeighbours>;
  /// What one call of plan() works on.
  struct Search {
    const PlanRequest& request;
    const MapView& view;
    core::StageBudget& budget;
    core::Work& work;
    core::CounterRng rng;
  };

  /// Ends a search that has not become better by 1 % for so many samples.
  class Patience {
   public:
    Patience(double best_m, std::uint32_t samples) noexcept : mark_m_(best_m), samples_(samples) {}
    [[nodiscard]] bool is_over(double best_m, std::uint32_t sample) noexcept {
      if (best_m < 0.99 * mark_m_) {
        mark_m_ = best_m;
        mark_ = sample;
      }
      return sample - mark_ > samples_;
    }

   private:
    double mark_m_;
    std::uint32_t mark_{0};
    std::uint32_t samples_;
  };

  [[nodiscard]] Node& node(std::int32_t index) noexcept { return node_[static_cast<std::size_t>(index)]; }
  [[nodiscard]] bool full() const noexcept { return count_ == node_.size(); }
  /// To be asked before each add_node().
  [[nodiscard]] bool may_add() noexcept { return !full() && !node_pool_.exhausted(); }
  /// The tree is the start alone.
  void clear(Search& s) noexcept;
  std::int32_t add_node(const Vector3& p_W, std::int32_t parent, core::Work& work) noexcept;
  void reparent(std::int32_t child, std::int32_t parent, double cost_m) noexcept;
  /// A step from the nearest node towards the sample, by the best parent, and rewiring; -1 if nothing came of
  /// it, or if no path of at most `bound_m` to the goal could lead there.
  std::int32_t try_extend(Search& s, const Vector3& sample_W, double bound_m) noexcept;
  [[nodiscard]] bool is_over(Search& s) const noexcept {
    return s.work.volume_m3 >= s.request.volume_m3 || s.budget.spent(s.work);
  }

  // The goal is known free space.
  [[nodiscard]] Status connect(Search& s, PlanResult& result) noexcept;
  [[nodiscard]] bool find_first(Search& s) noexcept;
  /// Of the first solution the answer.
  [[nodiscard]] Status tighten(Search& s, PlanResult& result) noexcept;
  /// Informed RRT*: grows the tree where it can still hold a path shorter than `best_W`, of length best_m, and
  /// pulls what it finds tight. kOk or kBudgetSpent.
  [[nodiscard]] Status improve(Search& s, double best_m, Path& best_W) noexcept;
  /// One sample of it: a new node, and by it a shorter way to the goal's node, if there is one. Returns the new
  /// node, or -1.
  [[nodiscard]] std::int32_t grow(Search& s, double best_m) noexcept;
  [[nodiscard]] std::int32_t advance(Search& s, std::int32_t from) noexcept;
  [[nodiscard]] Vector3 informed_sample(Search& s, double bound_m) const noexcept;
  [[nodiscard]] bool path_to(std::int32_t node, Path& path_W) const noexcept;
  /// The tree's path to a node and from there on along the best one, if free and at most `bound_m` long: how
  /// the other side of a single obstacle is tried. False: nothing to try, candidate_W is of no use.
  [[nodiscard]] bool splice(Search& s, std::int32_t from, const Path& best_W, double bound_m,
                            Path& candidate_W) const noexcept;
  void add_path(const Path& path_W, core::Work& work) noexcept;
  /// The first solution where sampling finds none.
  [[nodiscard]] bool find_on_lattice(Search& s) noexcept;
  /// Where ways are told such a search ends after so many lookups: what is left of the budget is for following them.
  [[nodiscard]] Status search_lattice(Search& s, const PlanRequest& request, Path& path_W) noexcept;

  // It is not.
  /// `map`: what s.view polls for.
  /// To where the ways that are known lead on: a path of at most `below_m` with its rest, as a whole.
  [[nodiscard]] bool follow_ways(Search& s, const MapView& map, double below_m, PlanResult& result) noexcept;
  /// From the start along the corners of a known way, as far as it goes: straight where that is free, by short searches
  /// elsewhere. At most kChained of them.
  [[nodiscard]] Path chain(Search& s, std::span<const Vector3> way_W) noexcept;
  [[nodiscard]] Status explore(Search& s, const MapView& map, bool goal_bad, std::int32_t best,
                               PlanResult& result) noexcept;
  /// A node to go to, what the way over it promises to take, and what another way has to save.
  struct Branch {
    std::int32_t node;
    double promise_m, margin_m;
  };
  /// Returns `straight` in the open, with what another way has to save there, or `best`. No promise beyond `moves_m` is worth a move.
  [[nodiscard]] Branch prefer_straight(Search& s, const MapView& map, double moves_m, const Branch& straight,
                                       const Branch& best) noexcept;
  [[nodiscard]] Vector3 sample(Search& s) const noexcept;
  [[nodiscard]] double promise_m(const Node& node, const PlanRequest& request) const noexcept;
  /// On the straight way on to the goal, to the first surface that is known; at most 12 m.
  [[nodiscard]] static double free_ahead_m(const PlanRequest& request, const MapView& view,
                                           const Vector3& p_W, std::uint64_t& lookups) noexcept;
  /// What that surface will cost, 0 if none is known.
  [[nodiscard]] double detour_m(const PlanRequest& request, const MapView& view, const Vector3& p_W,
                                std::uint64_t& lookups) const noexcept;
  void extract(const PlanRequest& request, const MapView& view, std::int32_t node,
               PlanResult& result) noexcept;

  Config config_;
  std::span<Node> node_;
  core::PoolRecord& node_pool_;
  std::span<std::uint64_t> visited_;
  core::PoolRecord& visited_pool_;
  NodeGrid grid_;
  LatticeSearch lattice_;
  std::size_t count_{0};
  std::size_t visited_count_{0};
  std::int32_t goal_{-1};  ///< The goal's node, once it is reached.
};

}  // namespace roborun::stages
