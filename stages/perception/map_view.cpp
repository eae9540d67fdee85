#include "stages/perception/map_view.hpp"

#include <algorithm>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "stages/perception/swept_ball.hpp"

namespace roborun::stages {
namespace {

constexpr double kMaxSegment_m = 10e3;

/// Of the pieces that a way is checked in.
double spacing_m(const MapView& view, double radius_m) noexcept {
  return std::max(radius_m, 0.5 * view.cell_m());
}

}  // namespace

BlockContent read_cell_by_cell(const MapView& view, const Vector3& corner_W, double cell_m, CellBlock& cells,
                               std::uint64_t& lookups) noexcept {
  std::uint32_t free = 0, occupied = 0;
  cells = {};
  for (std::size_t row = 0; row < cells.free.size(); ++row) {
    for (unsigned x = 0; x < kBlockCells; ++x) {
      const std::size_t y = row % kBlockCells, z = row / kBlockCells;
      const Vector3 index(x, static_cast<double>(y), static_cast<double>(z));
      const CellState state = view.at(corner_W + cell_m * (index + Vector3::Constant(0.5)), lookups);
      const auto bit = static_cast<std::uint16_t>(1U << x);
      if (state == CellState::kFree) cells.free[row] |= bit, ++free;
      if (state == CellState::kOccupied) cells.occupied[row] |= bit, ++occupied;
    }
  }
  cells.sure = cells.occupied;
  if (free == kBlockCells * cells.free.size()) return BlockContent::kFree;
  return free + occupied == 0 ? BlockContent::kUnknown : BlockContent::kMixed;
}

namespace {

/// Pairs of bits as one: both set, or (kAny) one of them.
template <bool kAny>
std::uint16_t halved(unsigned row) noexcept {
  unsigned pairs = (kAny ? row | row >> 1U : row & row >> 1U) & 0x5555U;
  pairs = (pairs | pairs >> 1U) & 0x3333U;
  pairs = (pairs | pairs >> 2U) & 0x0F0FU;
  return static_cast<std::uint16_t>((pairs | pairs >> 4U) & 0x00FFU);
}

/// One of the eight blocks of an eighth's size, into its place.
void merge_eighth(const CellBlock& fine, std::size_t eighth, CellBlock& cells) noexcept {
  constexpr std::size_t kHalf = kBlockCells / 2;
  const unsigned shift = (eighth & 1U) != 0 ? kHalf : 0U;
  for (std::size_t z = 0; z < kHalf; ++z) {
    for (std::size_t y = 0; y < kHalf; ++y) {
      const std::size_t at = 2 * z * kBlockCells + 2 * y, above = at + kBlockCells;
      const auto& f = fine.free;
      const unsigned all = unsigned{f[at]} & f[at + 1] & f[above] & f[above + 1];
      const auto any_of = [at, above](const CellRows& o) {
        return unsigned{o[at]} | o[at + 1] | o[above] | o[above + 1];
      };
      const std::size_t to =
          (z + ((eighth & 4U) != 0 ? kHalf : 0)) * kBlockCells + y + ((eighth & 2U) != 0 ? kHalf : 0);
      cells.free[to] = static_cast<std::uint16_t>(cells.free[to] | halved<false>(all) << shift);
      cells.occupied[to] =
          static_cast<std::uint16_t>(cells.occupied[to] | halved<true>(any_of(fine.occupied)) << shift);
      cells.vague[to] =
          static_cast<std::uint16_t>(cells.vague[to] | halved<true>(any_of(fine.vague)) << shift);
      cells.sure[to] = static_cast<std::uint16_t>(cells.sure[to] | halved<true>(any_of(fine.sure)) << shift);
    }
  }
}

}  // namespace

Vector3 corner_of_eighth(std::size_t eighth) noexcept {
  return {static_cast<double>(eighth & 1U), static_cast<double>(eighth >> 1U & 1U),
          static_cast<double>(eighth >> 2U & 1U)};
}

BlockContent read_eighths(const MapView& view, const Vector3& corner_W, CellBlock& cells,
                          std::uint64_t& lookups) noexcept {
  cells = {};
  std::size_t free = 0, unknown = 0;
  CellBlock fine;
  const double finest_m = view.finest_m();
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    const BlockContent content =
        view.read(corner_W + block_m(finest_m) * corner_of_eighth(eighth), finest_m, fine, lookups);
    if (content == BlockContent::kUnknown) {
      ++unknown;
      continue;
    }
    if (content == BlockContent::kFree) {
      ++free;
      fine.free.fill(0xFFFF);
      fine.occupied.fill(0);
      fine.vague.fill(0);
      fine.sure.fill(0);
    }
    merge_eighth(fine, eighth, cells);
  }
  if (free == 8) return BlockContent::kFree;
  return unknown == 8 ? BlockContent::kUnknown : BlockContent::kMixed;
}

std::uint64_t blocks_revision(const MapView& view, const Vector3& corner_W, double cell_m,
                              std::uint64_t& lookups) noexcept {
  ++lookups;
  if (cell_m != 2.0 * view.finest_m()) return view.revision(corner_W);
  std::uint64_t all = 0;
  for (std::size_t eighth = 0; eighth < 8; ++eighth) {
    const std::uint64_t one = view.revision(corner_W + block_m(0.5 * cell_m) * corner_of_eighth(eighth));
    if (one == 0) return 0;
    all = core::mix64(all + one);
  }
  return all;
}

bool is_segment_free(const MapView& view, const Vector3& a_W, const Vector3& b_W, double radius_m,
                     std::uint64_t& lookups) noexcept {
  const double length_m = (b_W - a_W).norm();
  if (!(length_m <= kMaxSegment_m) || !(radius_m >= 0.0)) return false;  // NaN included
  const int pieces = 1 + static_cast<int>(length_m / std::max(spacing_m(view, radius_m), 0.05));
  Vector3 from_W = a_W;
  for (int i = 1; i <= pieces; ++i) {
    const Vector3 to_W = a_W + (static_cast<double>(i) / pieces) * (b_W - a_W);
    if (!is_swept_free(view, from_W, to_W, radius_m, lookups)) return false;
    from_W = to_W;
  }
  return true;
}

double free_distance_m(const MapView& view, const Vector3& from_W, const Vector3& direction_W,
                       double radius_m, double max_m, std::uint64_t& lookups) noexcept {
  const double norm = direction_W.norm();
  if (!(norm > 0.0) || !std::isfinite(norm) || !is_finite(from_W) || !(max_m > 0.0) || !(radius_m >= 0.0))
    return 0.0;
  if (!is_ball_free(view, from_W, radius_m, lookups)) return 0.0;
  const double limit_m = std::min(max_m, kMaxSegment_m);
  const double step_m = std::max(0.5 * spacing_m(view, radius_m), 0.05);
  double free_m = 0.0;
  const int steps = static_cast<int>(std::ceil(limit_m / step_m));
  for (int i = 1; i <= steps; ++i) {
    const double next_m = std::min(i * step_m, limit_m);
    const Vector3 a_W = from_W + (free_m / norm) * direction_W;
    const Vector3 b_W = from_W + (next_m / norm) * direction_W;
    if (!is_swept_free(view, a_W, b_W, radius_m, lookups)) break;
    free_m = next_m;
  }
  return free_m;
}

}  // namespace roborun::stages
