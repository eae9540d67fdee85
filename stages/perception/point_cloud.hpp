/// Depth images as a point cloud, one averaged point a cell. Source: RoboRun, precision operator p0 of the
/// point cloud.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/executive/stage_budget.hpp"
#include "core/memory/arena.hpp"
#include "core/precision.hpp"
#include "stages/perception/frame_guard.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/perception/pixel_kinds.hpp"
#include "stages/stage.hpp"

namespace roborun::stages {

/// Mean of the end points that fell into one cell of the grid.
struct CloudPoint {
  Vector3 p_W = Vector3::Zero();
  std::uint32_t count{};
};

/// Which points somebody will ask for; by default all.
struct CloudNeed {
  Vector3 center_W = Vector3::Zero();                       ///< Of the vehicle.
  double reach_m{std::numeric_limits<double>::infinity()};  ///< All points that are nearer to it ...
  double low_m{-std::numeric_limits<double>::infinity()};   ///< ... between these heights,
  double high_m{std::numeric_limits<double>::infinity()};
  /// and, however far it is, the nearest point within this box, which lies between the heights.
  Aabb box_W{};
};

class PointCloud {
 public:
  struct Config {
    std::size_t max_points{65536};  ///< Cells of the grid, a power of two. [256, 4194304]
    PrecisionLattice lattice{};
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool power = max_points != 0 && (max_points & (max_points - 1)) == 0;
      return power && max_points >= 256 && max_points <= 4194304 ? Status::kOk : Status::kInvalidArgument;
    }
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t steps{}, frames_refused{}, points_dropped{};
  };

  [[nodiscard]] static constexpr std::size_t arena_bytes(const Config& config) noexcept {
    return config.max_points * (sizeof(Entry) + sizeof(CloudPoint) + sizeof(std::uint32_t)) + 64;
  }
  /// Precondition, asserted: config.validate() is kOk. Check arena.exhausted() afterwards.
  PointCloud(const Config& config, core::Arena& arena) noexcept;

  /// Averages the surfaces of all frames in cells of cell_size_m(level) of the lattice. Bad frames (FrameGuard) are refused
  /// whole and counted; when three quarters of the grid are full, further new cells are dropped and counted
  /// (kCapacity). kInvalidArgument if no frame was usable. work.units counts pixels. RT-safe: O(pixels),
  /// polls the budget every row: kBudgetSpent. Only pixels near to what `need` asks for go into the grid, and none that lies
  /// between two depths (tell_pixels()).
  [[nodiscard]] Status step(std::span<const PosedDepthFrame> frames, int level, const CloudNeed& need,
                            core::StageBudget& budget, core::Work& work) noexcept;
  [[nodiscard]] Status step(std::span<const PosedDepthFrame> frames, int level, core::StageBudget& budget,
                            core::Work& work) noexcept {
    return step(frames, level, {}, budget, work);
  }
  /// Points of the last step, in the order in which their cells were first met: the same on every machine. Those that
  /// were needed are all there and the same whatever else was; others may be there, but none that is nearer within the box.
  [[nodiscard]] std::span<const CloudPoint> points() const noexcept { return point_.first(count_); }
  /// Space between the cameras and what they see in the last step: pyramids of the pixels, cut at the height
  /// limits.
  [[nodiscard]] double seen_volume_m3() const noexcept { return seen_volume_m3_; }
  /// Space counts only between these heights (what the map stores).
  void set_height_limits(double low_m, double high_m) noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Entry {
    std::uint64_t key{};  ///< 0: empty.
    std::uint32_t point{};
  };
  /// Decides pixel by pixel. A point is the mean of all pixels of its cell, so these margins are wide enough to want either all
  /// pixels of a needed point or, of others, some whose mean is nothing that was asked for.
  class Wanted {
   public:
    Wanted(const CloudNeed& need, double cell_m) noexcept;
    [[nodiscard]] bool includes(const Vector3& p_W) noexcept;

   private:
    Vector3 center_W_;
    double low_m_, high_m_;
    double diagonal_m_;  ///< No two pixels of a cell are farther apart.
    double least_reach_m_;
    double reach2_m2_{std::numeric_limits<double>::infinity()};
    double nearest2_m2_{std::numeric_limits<double>::infinity()};
    Aabb inner_W_;  ///< Whose pixels have their means in the box.
  };
  /// A row of an image.
  struct Row {
    const PosedDepthFrame& posed;
    std::size_t v;
    double z;                   ///< Of the camera's direction, whose x is 1.
    std::span<const double> y;  ///< The same of each pixel.
    double pixel_area;          ///< Of the plane at depth 1.
    PixelRules rules;
  };
  /// False if the grid was full.
  [[nodiscard]] bool add_row(const Row& row, double cell_m, Wanted& wanted) noexcept;
  bool add(const Vector3& p_W, double cell_m) noexcept;

  PrecisionLattice lattice_;
  std::span<Entry> grid_;
  core::PoolRecord& grid_pool_;
  std::span<CloudPoint> point_;
  core::PoolRecord& point_pool_;
  std::span<std::uint32_t> used_;  ///< Grid entries to clear before the next step.
  core::PoolRecord& used_pool_;
  FrameGuard guard_{};
  PixelRow pixels_{};
  std::size_t count_{0};
  double seen_volume_m3_{0.0};
  double low_m_{-std::numeric_limits<double>::infinity()};
  double high_m_{std::numeric_limits<double>::infinity()};
  Counters counters_{};
};
static_assert(Stage<PointCloud>);

}  // namespace roborun::stages
