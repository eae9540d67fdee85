// See image_lines.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/image_lines.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include <algorithm>

#include "stages/perception/image_lines.hpp"
#include "stages/perception/vector_lanes.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

void end_cells_lanes(const PixelLine& line, std::span<const float> depth_m, const SurfaceDepths& depths,
                     SurfaceRow& row) {
  const Floats d;
  const Ints di;
  constexpr float kBias = 4096.0F;  // makes truncation round down
  constexpr std::int32_t kNone = -1;
  const std::size_t count = depth_m.size();
  constexpr std::size_t kPad = SurfaceRow::kPad;
  alignas(32) std::int32_t cell[3][kPad + kMaxImageSide + kPad];
  const auto some = [&](const float* depth, std::size_t u) {
    const auto z = hn::LoadU(d, depth);
    auto inside = hn::RebindMask(
        di, hn::And(hn::Gt(z, hn::Set(d, depths.least_m)), hn::Lt(z, hn::Set(d, depths.most_m))));
    const auto far = hn::IfThenElseZero(hn::RebindMask(d, inside), z);
    const auto column = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(u)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto direction =
          hn::Add(hn::Set(d, line.first[axis]), hn::Mul(column, hn::Set(d, line.step[axis])));
      const auto cells = hn::Add(hn::Mul(far, direction), hn::Set(d, line.rest[axis] + kBias));
      const auto c = hn::Add(hn::ConvertTo(di, cells),
                             hn::Set(di, line.origin[axis] - static_cast<std::int32_t>(kBias)));
      inside = hn::And(inside, hn::And(hn::Gt(c, hn::Set(di, line.low[axis] - 1)),
                                       hn::Lt(c, hn::Set(di, line.high[axis] + 1))));
      hn::Store(c, di, cell[axis] + kPad + u);
    }
    hn::Store(hn::IfThenElse(inside, hn::Load(di, cell[0] + kPad + u), hn::Set(di, kNone)), di,
              cell[0] + kPad + u);
  };
  const std::size_t lanes = hn::Lanes(d);
  std::size_t u = 0;
  for (; u + lanes <= count; u += lanes) some(depth_m.data() + u, u);
  if (u < count) {
    float tail[8] = {};
    for (std::size_t i = 0; u + i < count; ++i) tail[i] = depth_m[u + i];
    some(tail, u);
  }
  // Keep those that differ from their left neighbour.
  for (auto& axis : cell) axis[kPad - 1] = kNone;
  row.count = 0;
  for (u = 0; u < count; u += lanes) {
    const auto differs = [&](std::size_t axis) {
      return hn::Ne(hn::Load(di, cell[axis] + kPad + u), hn::LoadU(di, cell[axis] + kPad + u - 1));
    };
    const auto is_new = hn::Or(differs(0), hn::Or(differs(1), differs(2)));
    const auto keep = hn::And(is_new, hn::Gt(hn::Load(di, cell[0] + kPad + u), hn::Set(di, kNone)));
    // Not CompressStore(): Highway 1.0 copies its table of 1 KiB to the stack at each call.
    for (unsigned bits = bits_of(hn::RebindMask(d, keep)); bits != 0; bits &= bits - 1, ++row.count) {
      const std::size_t at = kPad + u + static_cast<std::size_t>(__builtin_ctz(bits));
      for (std::size_t axis = 0; axis < 3; ++axis) row.cell[axis][row.count] = cell[axis][at];
    }
  }
}

void tile_boxes_lanes(const TileLine& line, const TileEntries& tiles, TileRow& row) {
  const Floats d;
  const Ints di;
  constexpr float kBias = 4096.0F;    // makes truncation round down
  constexpr float kRounding = 4e-3F;  // of a cell
  const auto m_per_step = hn::Set(d, 1.0F / line.steps_per_m);
  for (std::size_t x = 0; x < tiles.count; x += hn::Lanes(d)) {
    alignas(32) std::int32_t raw[8] = {};
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      const DepthEntry& e = tiles.entry[tiles.stride * std::min(x + i, tiles.count - 1)];
      raw[i] = e.least_steps | (static_cast<std::int32_t>(e.not_most_steps) << 16U);
      row.surface[x + i] = e.least_steps < DepthEntry::kMaxSteps;
    }
    const auto steps = hn::Load(di, raw);
    const auto near = hn::Mul(hn::ConvertTo(d, hn::And(steps, hn::Set(di, 0xFFFF))), m_per_step);
    const auto most = hn::Sub(hn::Set(di, DepthEntry::kMaxSteps), hn::ShiftRight<16>(steps));
    const auto far = hn::Mul(hn::ConvertTo(d, most), m_per_step);
    const auto column = hn::ConvertTo(d, hn::Iota(di, static_cast<std::int32_t>(x)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto center = hn::Add(hn::Set(d, line.first[axis]), hn::Mul(column, hn::Set(d, line.step[axis])));
      const auto half = hn::Set(d, line.half[axis]);
      const auto low = hn::Sub(center, half), high = hn::Add(center, half);
      const auto cell = [&](auto offset, float margin) {
        return hn::Add(hn::ConvertTo(di, hn::Add(offset, hn::Set(d, line.rest[axis] + kBias + margin))),
                       hn::Set(di, line.origin[axis] - static_cast<std::int32_t>(kBias)));
      };
      hn::Store(cell(hn::Min(hn::Mul(low, near), hn::Mul(low, far)), -kRounding), di,
                row.low[axis].data() + x);
      hn::Store(cell(hn::Max(hn::Mul(high, near), hn::Mul(high, far)), kRounding), di,
                row.high[axis].data() + x);
      hn::Store(cell(hn::Mul(center, near), 0.0F), di, row.nearest[axis].data() + x);
    }
  }
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(end_cells_lanes);
HWY_EXPORT(tile_boxes_lanes);

void end_cells(const PixelLine& line, std::span<const float> depth_m, const SurfaceDepths& depths,
               SurfaceRow& row) noexcept {
  HWY_DYNAMIC_DISPATCH(end_cells_lanes)(line, depth_m, depths, row);
}

void tile_boxes(const TileLine& line, const TileEntries& tiles, TileRow& row) noexcept {
  HWY_DYNAMIC_DISPATCH(tile_boxes_lanes)(line, tiles, row);
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
