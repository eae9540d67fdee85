// See brick_flags.hpp.
// Compiled once per instruction set: foreach_target includes this file again.
#include "stages/perception/instruction_sets.hpp"
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/perception/brick_flags.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

#include "stages/perception/brick_flags.hpp"

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

std::size_t brick_flags_lanes(const std::uint64_t* word, std::uint8_t* mip) {
  // Of eight cells, half bytes: bit 0 alone is free; bit 3, or bit 0 with others, is occupied; else unknown.
  constexpr std::uint32_t kOnes = 0x11111111U;
  std::size_t unknown = 0;
  std::size_t i = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<std::uint32_t, 8> d;
  const hn::Repartition<std::uint64_t, decltype(d)> d64;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  const auto ones = hn::Set(d, kOnes), zero = hn::Zero(d);
  const auto flag = [&](auto cells, std::uint8_t value) {
    return hn::IfThenElse(hn::Eq(cells, zero), zero, hn::Set(d, value));
  };
  auto sum = zero;
  for (; i < kCellsPerBrick / 8; i += hn::Lanes(d)) {
    const auto cells = hn::BitCast(d, hn::LoadU(d64, word + i / 2));
    const auto more = hn::Or(hn::ShiftRight<1>(cells), hn::ShiftRight<2>(cells));
    const auto occupied = hn::And(hn::Or(hn::ShiftRight<3>(cells), hn::And(cells, more)), ones);
    const auto free = hn::AndNot(occupied, hn::And(cells, ones));
    const auto unknown_here = hn::AndNot(hn::Or(occupied, free), ones);
    sum = hn::Add(sum, hn::ShiftRight<28>(hn::Mul(unknown_here, ones)));
    const auto flags = hn::Or(flag(unknown_here, content::kUnknown),
                              hn::Or(flag(occupied, content::kOccupied), flag(free, content::kFree)));
    hn::StoreU(hn::TruncateTo(d8, flags), d8, mip + i);
  }
  unknown = hn::GetLane(hn::SumOfLanes(d, sum));
#endif
  for (; i < kCellsPerBrick / 8; ++i) {
    const auto cells = static_cast<std::uint32_t>(word[i / 2] >> (32U * (i % 2)));
    const std::uint32_t occupied = ((cells >> 3U) | (cells & ((cells >> 1U) | (cells >> 2U)))) & kOnes;
    const std::uint32_t free = cells & kOnes & ~occupied;
    const std::uint32_t unknown_here = kOnes & ~(occupied | free);
    unknown += (unknown_here * kOnes) >> 28U;
    mip[i] = static_cast<std::uint8_t>((unknown_here != 0 ? content::kUnknown : 0U) |
                                       (occupied != 0 ? content::kOccupied : 0U) |
                                       (free != 0 ? content::kFree : 0U));
  }
  return kCellsPerBrick - unknown;
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace roborun::stages {

HWY_EXPORT(brick_flags_lanes);

std::size_t brick_flags(const BrickWords& word, std::uint8_t* mip) noexcept {
  return HWY_DYNAMIC_DISPATCH(brick_flags_lanes)(word.data(), mip);
}

}  // namespace roborun::stages
#endif  // HWY_ONCE
