#include "stages/perception/octomap_backend/octomap_backend.hpp"

#include <octomap/octomap.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "core/record/state_hash.hpp"
#include "firmware_if/assert.hpp"
#include "stages/perception/depth_steps.hpp"
#include "stages/perception/empty_reach.hpp"
#include "stages/perception/frame_guard.hpp"

namespace roborun::stages {
namespace {

using Key = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

constexpr std::uint8_t kUnknown = static_cast<std::uint8_t>(CellState::kUnknown);
constexpr std::uint8_t kFree = static_cast<std::uint8_t>(CellState::kFree);
constexpr std::uint8_t kOccupied = static_cast<std::uint8_t>(CellState::kOccupied);

octomap::point3d to_octomap(const Vector3& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

class OctomapBackend final : public OccupancyMap, private MapView {
 public:
  explicit OctomapBackend(const OctomapConfig& config) : config_(config) {
    for (int level = 0; level < kPrecisionLevels; ++level) {
      tree_[static_cast<std::size_t>(level)] = std::make_unique<octomap::OcTree>(size_m(level));
    }
  }

  [[nodiscard]] Status integrate(const IntegrationRequest& request, core::StageBudget& budget,
                                 IntegrationResult& result) noexcept override {
    try {
      return insert(request, budget, result);
    } catch (...) {
      return Status::kCapacity;
    }
  }
  [[nodiscard]] Status export_view(const ExportRequest& request, core::StageBudget&,
                                   core::Work& work) noexcept override {
    try {
      return copy_window(request, work);
    } catch (...) {
      return Status::kCapacity;
    }
  }
  void forget() noexcept override {
    for (const auto& tree : tree_) tree->clear();
    known_m3_ = 0.0;
    count_ = {};
  }
  [[nodiscard]] const MapView& view() const noexcept override { return *this; }
  [[nodiscard]] double known_volume_m3() const noexcept override { return known_m3_; }
  [[nodiscard]] std::size_t bytes() const noexcept override {
    std::size_t total = 0;
    for (const auto& tree : tree_) total += tree->memoryUsage();
    return total;
  }
  [[nodiscard]] std::uint64_t digest() const noexcept override {
    core::StateHash hash;
    for (const auto& tree : tree_) {
      for (auto it = tree->begin_leafs(), end = tree->end_leafs(); it != end; ++it) {
        const octomap::OcTreeKey key = it.getKey();
        hash.add((std::uint64_t{key[0]} << 32U) | (std::uint64_t{key[1]} << 16U) | std::uint64_t{key[2]});
        hash.add(static_cast<double>(it->getLogOdds()));
      }
    }
    return hash.value();
  }

 private:
  struct Mean {
    Vector3 sum_W = Vector3::Zero();
    double count{};
  };

  /// Grid average of the end points; pixels without a return end beyond the range, where stock insertion only
  /// clears.
  static void add_cloud(const PosedDepthFrame& posed, double cell_m, std::map<Key, Mean>& cells) {
    const firmware_if::DepthFrame& frame = posed.frame;
    const auto across = static_cast<double>(frame.tan_half_width);
    const auto along = static_cast<double>(frame.tan_half_height);
    for (int v = 0; v < frame.height; ++v) {
      for (int u = 0; u < frame.width; ++u) {
        const float raw_m =
            frame.depth_m[static_cast<std::size_t>(v) * frame.width + static_cast<std::size_t>(u)];
        if (!(raw_m > frame.range_min_m)) continue;
        const Vector3 direction(1.0, across - (u + 0.5) * 2.0 * across / frame.width,
                                along - (v + 0.5) * 2.0 * along / frame.height);
        const double depth_m =
            raw_m < frame.range_m ? static_cast<double>(raw_m) : 1.05 * static_cast<double>(frame.range_m);
        const Vector3 p_W = posed.X_WC * (depth_m * direction);
        const auto index = [cell_m](double x) { return static_cast<std::int64_t>(std::floor(x / cell_m)); };
        Mean& mean = cells[{index(p_W.x()), index(p_W.y()), index(p_W.z())}];
        mean.sum_W += p_W;
        mean.count += 1.0;
      }
    }
  }

  Status insert(const IntegrationRequest& request, core::StageBudget& budget, IntegrationResult& result) {
    result = {};
    const int level = std::clamp(request.level, 0, kPrecisionLevels - 1);
    const double cell_m = size_m(level);
    result.work.level = level;
    octomap::OcTree& tree = *tree_[static_cast<std::size_t>(level)];
    bool any = false;
    Status status = Status::kOk;
    for (const PosedDepthFrame& posed : request.frames) {
      if (check_frame(posed) != Status::kOk || request.trajectory_W.empty()) {
        ++result.frames_refused;
        continue;
      }
      any = true;
      std::map<Key, Mean> cells;
      add_cloud(posed, cell_m, cells);
      // Space nearest to the trajectory first: rays sorted by the distance of their ends.
      std::vector<std::pair<double, Vector3>> ends;
      for (const auto& [key, mean] : cells) {
        const Vector3 p_W = mean.sum_W / mean.count;
        double nearest_m = std::numeric_limits<double>::infinity();
        for (const Vector3& q_W : request.trajectory_W) nearest_m = std::min(nearest_m, (p_W - q_W).norm());
        ends.emplace_back(nearest_m, p_W);
      }
      std::stable_sort(ends.begin(), ends.end(),
                       [](const auto& a, const auto& b) { return a.first < b.first; });
      const double share_m3 = request.volume_m3 / static_cast<double>(request.frames.size());
      double used_m3 = 0.0;
      octomap::Pointcloud cloud;
      const double ray_m3 = seen_m3(posed) / static_cast<double>(std::max<std::size_t>(ends.size(), 1));
      for (const auto& [distance_m, p_W] : ends) {
        if (used_m3 + ray_m3 > share_m3) {
          status = Status::kBudgetSpent;
          break;
        }
        used_m3 += ray_m3;
        cloud.push_back(to_octomap(p_W));
      }
      tree.insertPointCloud(cloud, to_octomap(posed.X_WC.p_RT), static_cast<double>(posed.frame.range_m),
                            false, false);
      result.work.volume_m3 += used_m3;
      result.work.units += cloud.size();
      if (budget.spent(result.work)) {
        status = Status::kBudgetSpent;
        break;
      }
    }
    if (!any) return Status::kInvalidArgument;
    free_vehicle(tree, request.frames.front().X_WC.p_RT - request.frames.front().p_BC_W,
                 request.assumed_half_m);
    return status;
  }

  /// Where the vehicle is, nothing else is: the cells that no ray can tell.
  void free_vehicle(octomap::OcTree& tree, const Vector3& p_WB, const Vector3& assumed_half_m) const {
    const double cell_m = tree.getResolution();
    const double reach_m = std::max(config_.vehicle_radius_m + 0.4, assumed_half_m.maxCoeff());
    const int n = std::max(1, static_cast<int>(std::ceil(reach_m / cell_m)));
    for (int dz = -n; dz <= n; ++dz) {
      for (int dy = -n; dy <= n; ++dy) {
        for (int dx = -n; dx <= n; ++dx) {
          const Vector3 offset = cell_m * Vector3(dx, dy, dz);
          if (offset.norm() > std::max(config_.vehicle_radius_m, 0.5 * cell_m) &&
              (offset.cwiseAbs() - assumed_half_m).maxCoeff() > 0.0)
            continue;
          const octomap::point3d p = to_octomap(p_WB + offset);
          if (tree.search(p) == nullptr) tree.updateNode(p, false);
        }
      }
    }
  }

  /// Space between the camera and what it sees, within the height limits of the map.
  [[nodiscard]] double seen_m3(const PosedDepthFrame& posed) const {
    const firmware_if::DepthFrame& f = posed.frame;
    const auto across = static_cast<double>(f.tan_half_width);
    const auto along = static_cast<double>(f.tan_half_height);
    const double area = 4.0 * across * along / (f.width * f.height);
    const double height_m = posed.X_WC.p_RT.z();
    double total_m3 = 0.0;
    for (int v = 0; v < f.height; ++v) {
      for (int u = 0; u < f.width; ++u) {
        double depth_m = static_cast<double>(visible_depth_m(
            f.depth_m[static_cast<std::size_t>(v) * f.width + static_cast<std::size_t>(u)],
            empty_reach_m(posed, static_cast<std::size_t>(u), static_cast<std::size_t>(v)), f.range_min_m));
        const Vector3 d_W = posed.X_WC.R_RT * Vector3(1.0, across - (u + 0.5) * 2.0 * across / f.width,
                                                      along - (v + 0.5) * 2.0 * along / f.height);
        if (d_W.z() > 0.0)
          depth_m = std::min(depth_m, std::max(config_.bounds_W.max_W.z() - height_m, 0.0) / d_W.z());
        if (d_W.z() < 0.0)
          depth_m = std::min(depth_m, std::max(height_m - config_.bounds_W.min_W.z(), 0.0) / -d_W.z());
        total_m3 += area * depth_m * depth_m * depth_m / 3.0;
      }
    }
    return total_m3;
  }

  Status copy_window(const ExportRequest& request, core::Work& work) {
    work = {};
    work.level = std::clamp(request.level, 0, kPrecisionLevels - 1);
    if (!is_finite(request.center_W) || !(request.volume_m3 >= 0.0)) return Status::kInvalidArgument;
    cell_m_ = size_m(work.level);
    // The window at its finest, aligned to the coarsest lattice so that cells of p1 never straddle its border.
    const double coarse_m = size_m(kPrecisionLevels - 1);
    std::array<std::int64_t, 3> fine{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      const double low_m =
          std::max(request.center_W[axis] - config_.view_reach_m, config_.bounds_W.min_W[axis]);
      const double high_m =
          std::min(request.center_W[axis] + config_.view_reach_m, config_.bounds_W.max_W[axis]);
      min_W_[axis] = std::floor(low_m / coarse_m) * coarse_m;
      fine[i] = 32 * static_cast<std::int64_t>(std::max(std::ceil((high_m - min_W_[axis]) / coarse_m), 0.0));
      count_[i] = fine[i] >> work.level;
    }
    std::vector<std::uint8_t> state(static_cast<std::size_t>(fine[0] * fine[1] * fine[2]), kUnknown);
    if (state.empty()) return Status::kInvalidArgument;
    paint(fine, state, work);
    limit_volume(request, fine, state, work);

    cell_.assign(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]), kFree);
    for (std::int64_t z = 0; z < fine[2]; ++z) {
      for (std::int64_t y = 0; y < fine[1]; ++y) {
        for (std::int64_t x = 0; x < fine[0]; ++x) {
          const std::uint8_t s = state[static_cast<std::size_t>((z * fine[1] + y) * fine[0] + x)];
          std::uint8_t& c = cell_[index(x >> work.level, y >> work.level, z >> work.level)];
          if (s == kOccupied || (s == kUnknown && c == kFree)) c = s;
        }
      }
    }
    sum_blocked();
    return Status::kOk;
  }

  /// Coarse trees first, finer ones over them.
  void paint(const std::array<std::int64_t, 3>& fine, std::vector<std::uint8_t>& state,
             core::Work& work) const {
    const Vector3 max_W =
        min_W_ + finest_m() * Vector3(static_cast<double>(fine[0]), static_cast<double>(fine[1]),
                                      static_cast<double>(fine[2]));
    for (std::size_t level = tree_.size(); level-- > 0;) {
      const octomap::OcTree& tree = *tree_[level];
      if (tree.size() == 0) continue;
      for (auto it = tree.begin_leafs_bbx(to_octomap(min_W_), to_octomap(max_W)), end = tree.end_leafs_bbx();
           it != end; ++it) {
        ++work.units;
        const double half_m = 0.5 * it.getSize();
        std::array<std::int64_t, 3> low{};
        std::array<std::int64_t, 3> high{};
        const octomap::point3d center = it.getCoordinate();
        for (unsigned i = 0; i < 3; ++i) {
          const double local_m = static_cast<double>(center(i)) - min_W_[static_cast<Eigen::Index>(i)];
          low[i] = std::clamp<std::int64_t>(std::lround((local_m - half_m) / finest_m()), 0, fine[i]);
          high[i] = std::clamp<std::int64_t>(std::lround((local_m + half_m) / finest_m()), 0, fine[i]);
        }
        const std::uint8_t value = tree.isNodeOccupied(*it) ? kOccupied : kFree;
        for (std::int64_t z = low[2]; z < high[2]; ++z) {
          for (std::int64_t y = low[1]; y < high[1]; ++y) {
            std::uint8_t* row = state.data() + (z * fine[1] + y) * fine[0];
            std::fill(row + low[0], row + high[0], value);
          }
        }
      }
    }
  }

  /// What is farther from the centre than v1 reaches becomes unknown again.
  void limit_volume(const ExportRequest& request, const std::array<std::int64_t, 3>& fine,
                    std::vector<std::uint8_t>& state, core::Work& work) {
    const double cell_m3 = finest_m() * finest_m() * finest_m();
    std::vector<double> ring_m3(128, 0.0);
    const auto ring_of = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const Vector3 p_W =
          min_W_ + finest_m() * Vector3(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5,
                                        static_cast<double>(z) + 0.5);
      return std::min(static_cast<std::size_t>((p_W - request.center_W).norm()), ring_m3.size() - 1);
    };
    known_m3_ = 0.0;
    for (std::int64_t z = 0; z < fine[2]; ++z) {
      for (std::int64_t y = 0; y < fine[1]; ++y) {
        for (std::int64_t x = 0; x < fine[0]; ++x) {
          if (state[static_cast<std::size_t>((z * fine[1] + y) * fine[0] + x)] == kUnknown) continue;
          ring_m3[ring_of(x, y, z)] += cell_m3;
          known_m3_ += cell_m3;
        }
      }
    }
    std::size_t last = 0;
    while (last < ring_m3.size() && (last < 2 || work.volume_m3 + ring_m3[last] <= request.volume_m3))
      work.volume_m3 += ring_m3[last++];
    if (last == ring_m3.size()) return;
    for (std::int64_t z = 0; z < fine[2]; ++z) {
      for (std::int64_t y = 0; y < fine[1]; ++y) {
        for (std::int64_t x = 0; x < fine[0]; ++x) {
          if (ring_of(x, y, z) >= last)
            state[static_cast<std::size_t>((z * fine[1] + y) * fine[0] + x)] = kUnknown;
        }
      }
    }
  }

  /// Summed-volume table of the cells that are not free: a box is then eight reads.
  void sum_blocked() {
    const std::int64_t nx = count_[0] + 1, ny = count_[1] + 1;
    sum_.assign(static_cast<std::size_t>(nx * ny * (count_[2] + 1)), 0);
    const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) -> std::int32_t& {
      return sum_[static_cast<std::size_t>((z * ny + y) * nx + x)];
    };
    for (std::int64_t z = 1; z <= count_[2]; ++z) {
      for (std::int64_t y = 1; y <= count_[1]; ++y) {
        for (std::int64_t x = 1; x <= count_[0]; ++x) {
          at(x, y, z) = (cell_[index(x - 1, y - 1, z - 1)] == kFree ? 0 : 1) + at(x - 1, y, z) +
                        at(x, y - 1, z) + at(x, y, z - 1) - at(x - 1, y - 1, z) - at(x - 1, y, z - 1) -
                        at(x, y - 1, z - 1) + at(x - 1, y - 1, z - 1);
        }
      }
    }
  }

  [[nodiscard]] std::size_t index(std::int64_t x, std::int64_t y, std::int64_t z) const noexcept {
    return static_cast<std::size_t>((z * count_[1] + y) * count_[0] + x);
  }
  [[nodiscard]] bool cell_of(const Vector3& p_W, std::array<std::int64_t, 3>& cell) const noexcept {
    if (cell_.empty() || !config_.bounds_W.contains(p_W)) return false;
    for (std::size_t i = 0; i < 3; ++i) {
      const double raw =
          std::floor((p_W[static_cast<Eigen::Index>(i)] - min_W_[static_cast<Eigen::Index>(i)]) / cell_m_);
      if (!(raw >= 0.0 && raw < static_cast<double>(count_[i]))) return false;
      cell[i] = static_cast<std::int64_t>(raw);
    }
    return true;
  }
  /// The window is copied at one precision.
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return is_free(box_W, lookups);
  }
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    std::array<std::int64_t, 3> a{};
    std::array<std::int64_t, 3> b{};
    ++lookups;
    const bool ordered = (box_W.min_W.array() <= box_W.max_W.array()).all();
    if (!ordered || !cell_of(box_W.min_W, a) || !cell_of(box_W.max_W, b)) return false;
    const std::int64_t nx = count_[0] + 1, ny = count_[1] + 1;
    const auto at = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      return sum_[static_cast<std::size_t>((z * ny + y) * nx + x)];
    };
    const std::int64_t x1 = b[0] + 1, y1 = b[1] + 1, z1 = b[2] + 1;
    return at(x1, y1, z1) - at(a[0], y1, z1) - at(x1, a[1], z1) - at(x1, y1, a[2]) + at(a[0], a[1], z1) +
               at(a[0], y1, a[2]) + at(x1, a[1], a[2]) - at(a[0], a[1], a[2]) ==
           0;
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override {
    std::array<std::int64_t, 3> cell{};
    ++lookups;
    return cell_of(p_W, cell) ? static_cast<CellState>(cell_[index(cell[0], cell[1], cell[2])])
                              : CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return cell_m_; }
  [[nodiscard]] double finest_m() const noexcept override { return config_.lattice.finest_m; }
  [[nodiscard]] double size_m(int level) const noexcept { return config_.lattice.cell_size_m(level); }

  OctomapConfig config_;
  std::array<std::unique_ptr<octomap::OcTree>, kPrecisionLevels> tree_;
  Vector3 min_W_ = Vector3::Zero();
  double cell_m_{kPublishedCell_m};
  std::array<std::int64_t, 3> count_{};
  std::vector<std::uint8_t> cell_;
  std::vector<std::int32_t> sum_;
  double known_m3_{0.0};
};

}  // namespace

std::unique_ptr<OccupancyMap> make_octomap_backend(const OctomapConfig& config) noexcept {
  ROBORUN_ASSERT(config.validate() == Status::kOk);
  try {
    return std::make_unique<OctomapBackend>(config);
  } catch (...) {
    return nullptr;
  }
}

}  // namespace roborun::stages
