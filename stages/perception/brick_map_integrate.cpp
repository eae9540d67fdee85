#include <algorithm>
#include <cmath>

#include "stages/perception/brick_map.hpp"

namespace roborun::stages {
namespace {

constexpr double kNear_m = 1e-3;  // a box that reaches behind the camera is projected from here on
constexpr std::uint64_t kPollEvery = 512;
constexpr double kOrderStep_m = 0.5;  // bricks whose distances differ by less keep their order in space

double node_volume_m3(int level) noexcept {
  const double edge_m = cell_size_m(level);
  return edge_m * edge_m * edge_m;
}

}  // namespace

std::size_t BrickMap::usable_frames(const IntegrationRequest& request, IntegrationResult& result) noexcept {
  camera_count_ = 0;
  for (std::size_t i = 0; i < request.frames.size(); ++i) {
    const PosedDepthFrame& posed = request.frames[i];
    if (camera_count_ == config_.max_frames || check_frame(posed) != Status::kOk ||
        pyramid_[camera_count_]->build(posed.frame) != Status::kOk) {
      ++result.frames_refused;
      continue;
    }
    Camera& c = camera_[camera_count_];
    c.R_CW = posed.X_WC.R_RT.transpose();
    c.abs_R_CW = c.R_CW.cwiseAbs();
    c.p_WC = posed.X_WC.p_RT;
    c.tan_half = static_cast<double>(posed.frame.tan_half_fov_ratio);
    c.width = posed.frame.width;
    c.height = posed.frame.height;
    c.pixels_per_tan = 0.5 * c.width / c.tan_half;
    c.rows_per_tan = 0.5 * c.height / c.tan_half;
    c.range_m = posed.frame.range_m;
    frame_of_[camera_count_] = i;
    ++camera_count_;
  }
  counters_.frames_refused += result.frames_refused;
  complete_ = camera_count_ == config_.max_frames;
  return camera_count_;
}

std::size_t BrickMap::order_bricks(const IntegrationRequest& request) noexcept {
  // Everything that a camera can see, as a box around all of them; a cubic frustum of range r reaches sqrt(3)
  // r.
  Vector3 low = camera_[0].p_WC;
  Vector3 high = low;
  for (std::size_t i = 0; i < camera_count_; ++i) {
    const double reach_m = static_cast<double>(camera_[i].range_m) *
                           std::sqrt(1.0 + 2.0 * camera_[i].tan_half * camera_[i].tan_half);
    low = low.cwiseMin(camera_[i].p_WC - Vector3::Constant(reach_m));
    high = high.cwiseMax(camera_[i].p_WC + Vector3::Constant(reach_m));
  }
  const Aabb& bounds = config_.bounds_W;
  low = low.cwiseMax(bounds.min_W).cwiseMin(bounds.max_W);
  high = high.cwiseMin(bounds.max_W).cwiseMax(bounds.min_W);
  const auto index = [](double p_m, double corner_m, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::floor((p_m - corner_m) / kBrick_m)), 0, count - 1);
  };
  const std::int32_t x0 = index(low.x(), corner_W_.x(), nx_), x1 = index(high.x(), corner_W_.x(), nx_);
  const std::int32_t y0 = index(low.y(), corner_W_.y(), ny_), y1 = index(high.y(), corner_W_.y(), ny_);
  const std::int32_t z0 = index(low.z(), corner_W_.z(), nz_), z1 = index(high.z(), corner_W_.z(), nz_);

  // Counting sort by distance to the trajectory: bounded, stable, no comparison of doubles.
  constexpr std::size_t kBuckets = 256;
  std::array<std::uint32_t, kBuckets> start{};
  const auto key_of = [&request](const Vector3& center_W) {
    double nearest2 = 1e18;
    for (const Vector3& p_W : request.trajectory_W)
      nearest2 = std::min(nearest2, (p_W - center_W).squaredNorm());
    return static_cast<std::uint16_t>(
        std::min(std::sqrt(nearest2) / kOrderStep_m, static_cast<double>(kBuckets - 1)));
  };
  for (std::int32_t z = z0; z <= z1; ++z) {
    for (std::int32_t y = y0; y <= y1; ++y) {
      for (std::int32_t x = x0; x <= x1; ++x) {
        const std::uint16_t key = key_of(brick_center_W(x, y, z));
        order_key_[slot_of(x, y, z)] = key;
        ++start[key];
      }
    }
  }
  std::uint32_t total = 0;
  for (std::uint32_t& s : start) {
    const std::uint32_t count = s;
    s = total;
    total += count;
  }
  for (std::int32_t z = z0; z <= z1; ++z) {
    for (std::int32_t y = y0; y <= y1; ++y) {
      for (std::int32_t x = x0; x <= x1; ++x) {
        const std::size_t position = slot_of(x, y, z);
        order_[start[order_key_[position]]++] = static_cast<std::uint32_t>(position);
      }
    }
  }
  return total;
}

BrickMap::Sight BrickMap::sight(std::size_t camera, const Vector3& center_W, double half_m,
                                bool& inside) const noexcept {
  const Camera& c = camera_[camera];
  const Vector3 p_C = c.R_CW * (center_W - c.p_WC);
  const Vector3 e_C = half_m * c.abs_R_CW.rowwise().sum();
  const double far_m = p_C.x() + e_C.x();
  const double near_m = p_C.x() - e_C.x();
  inside = false;
  if (far_m <= kNear_m) return Sight::kHidden;  // behind the camera
  const double y_low = p_C.y() - e_C.y(), y_high = p_C.y() + e_C.y();
  const double z_low = p_C.z() - e_C.z(), z_high = p_C.z() + e_C.z();
  // The tangents of the four sides; u grows to the right (-y), v downwards (-z).
  const double inverse_near = 1.0 / std::max(near_m, kNear_m);
  const double inverse_far = 1.0 / far_m;
  const double left = y_high * (y_high > 0.0 ? inverse_near : inverse_far);
  const double right = y_low * (y_low > 0.0 ? inverse_far : inverse_near);
  const double up = z_high * (z_high > 0.0 ? inverse_near : inverse_far);
  const double down = z_low * (z_low > 0.0 ? inverse_far : inverse_near);
  if (right >= c.tan_half || left <= -c.tan_half || down >= c.tan_half || up <= -c.tan_half)
    return Sight::kHidden;
  inside = left <= c.tan_half && right >= -c.tan_half && up <= c.tan_half && down >= -c.tan_half;
  const auto pixel = [](double tangents, double scale, int count) {
    return std::clamp(static_cast<int>(tangents * scale), 0, count - 1);
  };
  const int u0 = pixel(std::max(c.tan_half - left, 0.0), c.pixels_per_tan, c.width);
  const int u1 = pixel(std::max(c.tan_half - right, 0.0), c.pixels_per_tan, c.width);
  const int v0 = pixel(std::max(c.tan_half - up, 0.0), c.rows_per_tan, c.height);
  const int v1 = pixel(std::max(c.tan_half - down, 0.0), c.rows_per_tan, c.height);
  const DepthPyramid::Bound bound = pyramid_[camera]->bound(u0, v0, u1, v1);
  const double margin_m = config_.depth_margin_m + config_.depth_margin_per_m * far_m * far_m;
  // What the camera calls empty up to its range is believed up to the range itself: no margin there.
  const double needed_m = std::min(far_m + margin_m, std::max(far_m, static_cast<double>(c.range_m)));
  if (static_cast<double>(bound.least_m) >= needed_m) return Sight::kFree;
  if (static_cast<double>(bound.most_m) < near_m) return Sight::kHidden;
  return Sight::kMixed;
}

BrickMap::Sight BrickMap::sight(const Vector3& center_W, double half_m) const noexcept {
  bool any_free = false;
  bool any_hidden = false;
  bool covered = complete_;
  for (std::size_t i = 0; i < camera_count_; ++i) {
    bool inside = false;
    const Sight seen = sight(i, center_W, half_m, inside);
    if (seen == Sight::kMixed) return Sight::kMixed;
    if (seen == Sight::kFree) {
      any_free = true;
      covered = covered || inside;
    } else if (inside) {
      any_hidden = true;
    }
  }
  if (!any_free) return Sight::kHidden;
  // Seen as free by one camera and as hidden by another that sees all of it: they disagree, look closer.
  return !any_hidden && covered ? Sight::kFree : Sight::kMixed;
}

bool BrickMap::clear_brick(std::uint32_t position, const IntegrationRequest& request,
                           core::StageBudget& budget, core::Work& work) noexcept {
  const auto nx = static_cast<std::uint32_t>(nx_);
  const auto ny = static_cast<std::uint32_t>(ny_);
  const auto bx = static_cast<std::int32_t>(position % nx);
  const auto by = static_cast<std::int32_t>((position / nx) % ny);
  const auto bz = static_cast<std::int32_t>(position / nx / ny);
  const Vector3 base_W = corner_W_ + kBrick_m * Vector3(bx, by, bz);
  const int finest = std::min(request.level, kBrickLevel);
  // Depth first: at most seven siblings wait on each of four levels.
  std::array<Node, 7 * kBrickLevel + 1> stack{};
  std::size_t depth = 0;
  stack[depth++] = {kBrickLevel, 0, 0, 0};
  Brick* brick = nullptr;
  while (depth > 0) {
    const Node node = stack[--depth];
    const double edge_m = cell_size_m(node.level);
    const Vector3 center_W = base_W + edge_m * Vector3(node.x + 0.5, node.y + 0.5, node.z + 0.5);
    if (++work.units % kPollEvery == 0 && budget.spent(work)) return false;
    const Sight seen = sight(center_W, 0.5 * edge_m);
    if (seen == Sight::kFree) {
      work.volume_m3 += node_volume_m3(node.level);
      const std::uint32_t morton = morton3(node.x, node.y, node.z);
      const std::int32_t slot = slot_[position];
      const bool nothing_new =
          slot >= 0 && !brick_[static_cast<std::size_t>(slot)].dirty &&
          brick_[static_cast<std::size_t>(slot)].flags(node.level, morton) == content::kFree;
      if (nothing_new) continue;
      if (brick == nullptr) brick = touch(bx, by, bz);
      if (brick == nullptr) return true;  // pool full, and nothing farther away to give up
      brick->add_free(node.level, morton);
    } else if (seen == Sight::kMixed && node.level > finest) {
      for (std::uint32_t child = 0; child < 8; ++child) {
        stack[depth++] = {node.level - 1, 2 * node.x + (child & 1U), 2 * node.y + ((child >> 1U) & 1U),
                          2 * node.z + (child >> 2U)};
      }
    }
  }
  return true;
}

void BrickMap::add_surfaces(const IntegrationRequest& request, double reach_m, core::Work& work) noexcept {
  for (std::size_t i = 0; i < camera_count_; ++i) {
    const PosedDepthFrame& posed = request.frames[frame_of_[i]];
    const firmware_if::DepthFrame& frame = posed.frame;
    const double t = static_cast<double>(frame.tan_half_fov_ratio);
    for (int v = 0; v < frame.height; ++v) {
      const double z = t - (v + 0.5) * 2.0 * t / frame.height;
      for (int u = 0; u < frame.width; ++u) {
        const float depth_m =
            frame.depth_m[static_cast<std::size_t>(v) * frame.width + static_cast<std::size_t>(u)];
        if (!(depth_m > 0.0F) || depth_m >= frame.range_m) continue;
        const double y = t - (u + 0.5) * 2.0 * t / frame.width;
        const Vector3 p_W = posed.X_WC * (static_cast<double>(depth_m) * Vector3(1.0, y, z));
        Cell cell{};
        if (!cell_of(p_W, cell)) continue;
        const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
        // Beyond the space that v0 paid for nothing is written: neither free nor occupied.
        if (order_key_[slot_of(bx, by, bz)] * kOrderStep_m > reach_m) continue;
        Brick* brick = touch(bx, by, bz);
        if (brick == nullptr) continue;
        const auto inside = [](std::int32_t c) { return static_cast<std::uint32_t>(c & (kBrickCells - 1)); };
        brick->add_hit(morton3(inside(cell.x), inside(cell.y), inside(cell.z)));
        ++work.units;
      }
    }
  }
}

void BrickMap::free_vehicle() noexcept {
  const double r_m = config_.vehicle_radius_m;
  const int n = static_cast<int>(std::ceil(r_m / kFinestCell_m));
  for (int dz = -n; dz <= n; ++dz) {
    for (int dy = -n; dy <= n; ++dy) {
      for (int dx = -n; dx <= n; ++dx) {
        const Vector3 offset = kFinestCell_m * Vector3(dx, dy, dz);
        Cell cell{};
        if (offset.norm() > r_m || !cell_of(vehicle_W_ + offset, cell)) continue;
        Brick* brick = touch(cell.x >> kBrickLevel, cell.y >> kBrickLevel, cell.z >> kBrickLevel);
        if (brick == nullptr) continue;
        const auto low = [](std::int32_t c) { return static_cast<std::uint32_t>(c & (kBrickCells - 1)); };
        brick->add_free(0, morton3(low(cell.x), low(cell.y), low(cell.z)));
      }
    }
  }
}

Status BrickMap::integrate(const IntegrationRequest& request, core::StageBudget& budget,
                           IntegrationResult& result) noexcept {
  result = {};
  result.work.level = std::clamp(request.level, 0, kPrecisionLevels - 1);
  if (usable_frames(request, result) == 0 || request.trajectory_W.empty()) return Status::kInvalidArgument;
  ++counters_.scans;
  vehicle_W_ = camera_[0].p_WC;
  const std::size_t count = order_bricks(request);
  Status status = Status::kOk;
  double reach_m = 1e18;
  for (std::size_t i = 0; i < count; ++i) {
    const bool finished = clear_brick(order_[i], request, budget, result.work);
    if (!finished || result.work.volume_m3 >= request.volume_m3) {
      if (i + 1 < count) {
        status = Status::kBudgetSpent;
        reach_m = order_key_[order_[i]] * kOrderStep_m;
      }
      break;
    }
  }
  free_vehicle();
  add_surfaces(request, reach_m, result.work);
  refresh_dirty();
  return status;
}

}  // namespace roborun::stages
