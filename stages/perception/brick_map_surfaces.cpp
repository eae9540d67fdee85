// How surfaces get into the map: pixel by pixel, or tile by tile.
#include <algorithm>
#include <bit>
#include <cmath>

#include "stages/perception/brick_map.hpp"

namespace roborun::stages {
namespace {

/// What is no wider may be a pole or a branch, but no body: half of the narrowest one.
constexpr double kThinMost_m = 0.2;
/// Of the error of a camera that mixes pixels, what has to fit into a cell: its surfaces are wrong more often than noise alone
/// would make them.
constexpr double kMixedSigmas = 1.5;
constexpr int kTileLevel = 2;  // where a tile may end is known in cells of this size
constexpr std::int32_t kTileCells = 1 << (kBrickLevel - kTileLevel);  // of a brick's edge

/// The depth at which a pixel ends a cell's edge beside where it says: one sigma, or kMixedSigmas of a camera that mixes.
double exact_reach_m(const DepthError& error, double finest_m) noexcept {
  const double sigmas = error.mixes ? kMixedSigmas : 1.0;
  const double a = error.quadratic_per_m, b = error.angle_rad;
  const double room_m = std::max(finest_m / sigmas - error.constant_m - error.place_m, 0.0);
  // a z^2 + b z = room
  const double root = b + std::sqrt(b * b + 4.0 * a * room_m);
  return root > 0.0 ? std::min(2.0 * room_m / root, static_cast<double>(kMaxRange_m))
                    : static_cast<double>(kMaxRange_m);
}

}  // namespace

std::array<float, 3> BrickMap::direction(const SurfaceCamera& camera, double u, double v,
                                         double edge_m) noexcept {
  const Matrix3& R = camera.posed->X_WC.R_RT;
  const double y = camera.column_pitch * (0.5 * camera.posed->frame.width - u);
  const double z = camera.row_pitch * (0.5 * camera.posed->frame.height - v);
  std::array<float, 3> result{};
  for (int axis = 0; axis < 3; ++axis)
    result[static_cast<std::size_t>(axis)] =
        static_cast<float>((R(axis, 0) + R(axis, 1) * y + R(axis, 2) * z) / edge_m);
  return result;
}

bool BrickMap::paid(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept {
  const int up = unit_level_ - kBrickLevel;
  const Position unit{bx >> up, by >> up, bz >> up};
  const bool in_reach = unit.x >= first_unit_.x && unit.y >= first_unit_.y && unit.z >= first_unit_.z &&
                        unit.x <= last_unit_.x && unit.y <= last_unit_.y && unit.z <= last_unit_.z;
  return in_reach && order_key_[unit_index(unit)] * kOrderStep_m <= reach_m_;
}

void BrickMap::add_pixels(const SurfaceCamera& camera, std::size_t v, std::size_t u0, std::size_t u1,
                          core::Work& work) noexcept {
  const firmware_if::DepthFrame& frame = camera.posed->frame;
  PixelLine line = camera.line;
  line.first = direction(camera, static_cast<double>(u0) + 0.5, static_cast<double>(v) + 0.5, finest_m());
  tell_pixels(frame, v, u0, u1, camera.kinds, pixels_);
  const auto depth_m = std::span(pixels_.depth_m).first(u1 - u0);
  end_cells(line, depth_m, {frame.range_min_m, std::min(camera.exact_m, frame.range_m)}, row_);
  add_cells(camera, false, work);
  if (camera.exact_m < frame.range_m) {
    end_cells(line, depth_m, {camera.exact_m, frame.range_m}, row_);
    add_cells(camera, true, work);
  }
  if (pixels_.any_thin) add_thin_pixels(camera, line);
}

void BrickMap::add_cells(const SurfaceCamera& camera, bool vague, core::Work& work) noexcept {
  std::size_t last_position = slot_.size();
  Brick* brick = nullptr;
  for (std::size_t n = 0; n < row_.count; ++n) {
    const Cell cell{row_.cell[0][n], row_.cell[1][n], row_.cell[2][n]};
    const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
    const std::size_t position = slot_of(bx, by, bz);
    if (position != last_position) {
      last_position = position;
      // Beyond the space that v0 paid for nothing is written: neither free nor occupied.
      brick = paid(bx, by, bz) ? surface_brick(bx, by, bz, camera.is_coarse()) : nullptr;
    }
    if (brick == nullptr) continue;
    const std::uint32_t morton = morton3(in_brick(cell.x), in_brick(cell.y), in_brick(cell.z));
    if (vague)
      brick->add_vague_hit(morton);
    else
      mixes_ ? brick->add_hit_once(morton) : brick->add_hit(morton);
    ++work.units;
  }
}

void BrickMap::add_thin_pixels(const SurfaceCamera& camera, const PixelLine& line) noexcept {
  for (std::size_t word = 0; word < pixels_.thin.size(); ++word) {
    for (std::uint64_t bits = pixels_.thin[word]; bits != 0; bits &= bits - 1) {
      const std::size_t u = 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
      const float depth_m = pixels_.depth_m[u];
      if (!(depth_m < camera.thin_reach_m)) continue;
      Vector3 p;
      for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        p[axis] = line.origin[k] + static_cast<double>(line.rest[k]) +
                  static_cast<double>(depth_m) * (static_cast<double>(line.first[k]) +
                                                  static_cast<double>(u) * static_cast<double>(line.step[k]));
      }
      const Vector3 p_W = corner_W_ + finest_m() * p;
      Cell cell{};
      if (!cell_of(p_W, cell) || moved_nearby(camera.moved_W, p_W)) continue;
      const std::int32_t bx = cell.x >> kBrickLevel, by = cell.y >> kBrickLevel, bz = cell.z >> kBrickLevel;
      if (!paid(bx, by, bz)) continue;
      thin_seen_ += static_cast<std::uint32_t>((pixels_.surely_thin[word] >> (u % 64)) & 1U);
      if (Brick* brick = surface_brick(bx, by, bz, camera.is_coarse()))
        brick->add_thin(morton3(in_brick(cell.x), in_brick(cell.y), in_brick(cell.z)));
    }
  }
}

Brick* BrickMap::surface_brick(std::int32_t bx, std::int32_t by, std::int32_t bz, bool coarse) noexcept {
  std::int32_t& slot = slot_[slot_of(bx, by, bz)];
  if (!coarse || slot >= 0 || slot <= kFreeBrick) return touch(bx, by, bz);
  slot = kSurfaceBrick;
  return nullptr;
}

bool BrickMap::knows(const Brick& brick, const Cell& low, const Cell& high) const noexcept {
  if (brick.cleared == free_now_) return false;
  const auto first = [](std::int32_t from, std::int32_t at) {
    return static_cast<std::uint32_t>(std::max(from - at * kTileCells, 0));
  };
  const auto last = [](std::int32_t to, std::int32_t at) {
    return static_cast<std::uint32_t>(std::min(to - at * kTileCells, kTileCells - 1));
  };
  for (std::uint32_t z = first(low.z, brick.z); z <= last(high.z, brick.z); ++z)
    for (std::uint32_t y = first(low.y, brick.y); y <= last(high.y, brick.y); ++y)
      for (std::uint32_t x = first(low.x, brick.x); x <= last(high.x, brick.x); ++x)
        if (brick.flags(kTileLevel, morton3(x, y, z)) != content::kUnknown) return true;
  return false;
}

bool BrickMap::note_surface(std::size_t tile) noexcept {
  if (!tiles_.surface[tile]) return true;
  constexpr int kShift = kBrickLevel - kTileLevel;
  const Cell low{tiles_.low[0][tile], tiles_.low[1][tile], tiles_.low[2][tile]};
  const Cell high{tiles_.high[0][tile], tiles_.high[1][tile], tiles_.high[2][tile]};
  const std::int32_t x0 = std::max(low.x >> kShift, 0), x1 = std::min(high.x >> kShift, nx_ - 1);
  for (std::int32_t bz = std::max(low.z >> kShift, 0); bz <= std::min(high.z >> kShift, nz_ - 1); ++bz) {
    for (std::int32_t by = std::max(low.y >> kShift, 0); by <= std::min(high.y >> kShift, ny_ - 1); ++by) {
      const std::int32_t* const row = slot_.data() + slot_of(0, by, bz);
      for (std::int32_t bx = x0; bx <= x1; ++bx) {
        const std::int32_t slot = row[bx];
        if (slot == kUnknownBrick || slot == kSurfaceBrick || slot == free_now_) continue;
        if (slot < 0 || knows(brick_[static_cast<std::size_t>(slot)], low, high)) return false;
      }
    }
  }
  const Cell at{tiles_.nearest[0][tile] >> kShift, tiles_.nearest[1][tile] >> kShift,
                tiles_.nearest[2][tile] >> kShift};
  const bool inside = at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < nx_ && at.y < ny_ && at.z < nz_;
  if (!inside || !paid(at.x, at.y, at.z)) return true;
  std::int32_t& slot = slot_[slot_of(at.x, at.y, at.z)];
  if (slot == kUnknownBrick) slot = kSurfaceBrick;
  return true;
}

void BrickMap::add_tiles(const SurfaceCamera& camera, const DepthPyramid& image, core::Work& work) noexcept {
  const firmware_if::DepthFrame& frame = camera.posed->frame;
  const Matrix3& R = camera.posed->X_WC.R_RT;
  // Two tiles of the pyramid a side, four for blocks: every second entry of a level above them.
  const DepthPyramid::Level& wide = image.level(image.tiles().shift + (camera.level >= kBlockLevel ? 2 : 1));
  const std::size_t side = std::size_t{2} << static_cast<unsigned>(wide.shift);
  const std::size_t columns = (static_cast<std::size_t>(wide.width) + 1) / 2;
  const double across = camera.column_pitch * static_cast<double>(side);
  const double along = camera.row_pitch * static_cast<double>(side);
  const double tile_cell_m = size_m(kTileLevel);
  const Vector3 origin = (camera.posed->X_WC.p_RT - corner_W_) / tile_cell_m;
  TileLine line;
  line.steps_per_m = image.steps_per_m();
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    line.origin[k] = static_cast<std::int32_t>(std::clamp(std::floor(origin[axis]), -1e8, 1e8));
    line.rest[k] = static_cast<float>(origin[axis] - line.origin[k]);
    line.step[k] = static_cast<float>(-across * R(axis, 1) / tile_cell_m);
    line.half[k] = static_cast<float>(0.5 * (across * std::fabs(R(axis, 1)) + along * std::fabs(R(axis, 2))) /
                                      tile_cell_m);
  }
  const DepthPyramid::Entry* entry = wide.entry;
  for (std::size_t v = 0; v < frame.height; v += side, entry += 2 * static_cast<std::size_t>(wide.width)) {
    const double half = 0.5 * static_cast<double>(side);
    line.first = direction(camera, half, static_cast<double>(v) + half, tile_cell_m);
    tile_boxes(line, {entry, 2, columns}, tiles_);
    work.units += columns;
    for (std::size_t x = 0; x < columns; ++x) {
      if (note_surface(x)) continue;
      std::size_t end = x + 1;
      while (end < columns && !note_surface(end)) ++end;
      for (std::size_t row = v; row < std::min<std::size_t>(v + side, frame.height); ++row)
        add_pixels(camera, row, x * side, std::min<std::size_t>(end * side, frame.width), work);
      x = end;
    }
  }
}

void BrickMap::add_surfaces(const IntegrationRequest& request, core::Work& work) noexcept {
  thin_seen_ = 0;
  for (std::size_t i = 0; i < cameras_.count; ++i) {
    SurfaceCamera camera;
    camera.posed = &request.frames[frame_of_[i]];
    // A surface that is only noted leaves its whole block unknown: no look at cells of less than 4.8 m does that.
    const bool notes = size_m(request.level) >= block_m(kPublishedCell_m);
    camera.level = notes ? request.level : std::min(request.level, kBrickLevel - 1);
    const firmware_if::DepthFrame& frame = camera.posed->frame;
    camera.column_pitch = 2.0 * static_cast<double>(frame.tan_half_width) / frame.width;
    camera.row_pitch = 2.0 * static_cast<double>(frame.tan_half_height) / frame.height;
    const Vector3 origin = (camera.posed->X_WC.p_RT - corner_W_) / finest_m();
    const DepthError& error = camera.posed->error;
    mixes_ = mixes_ || error.mixes;
    camera.kinds = pixel_rules(frame, error);
    camera.exact_m = static_cast<float>(exact_reach_m(error, finest_m()));
    camera.thin_reach_m = std::min(
        camera.exact_m, static_cast<float>(kThinMost_m / std::max(camera.column_pitch, camera.row_pitch)));
    camera.moved_W = request.moved_W;
    camera.line.low = {low_.x, low_.y, low_.z};
    camera.line.high = {high_.x, high_.y, high_.z};
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      camera.line.origin[k] = static_cast<std::int32_t>(std::clamp(std::floor(origin[axis]), -1e8, 1e8));
      camera.line.rest[k] = static_cast<float>(origin[axis] - camera.line.origin[k]);
      camera.line.step[k] =
          static_cast<float>(-camera.column_pitch / finest_m() * camera.posed->X_WC.R_RT(axis, 1));
    }
    if (camera.is_coarse()) {
      add_tiles(camera, *pyramid_[i], work);
    } else {
      for (std::size_t v = 0; v < frame.height; ++v) add_pixels(camera, v, 0, frame.width, work);
    }
  }
}

}  // namespace roborun::stages
