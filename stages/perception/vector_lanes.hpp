// Up to eight lanes of 32 bits, as all vector kernels of this folder use them. Included once per instruction
// set, after highway.h: the guard is Highway's, not #pragma once.
#if defined(ROBORUN_VECTOR_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef ROBORUN_VECTOR_LANES
#undef ROBORUN_VECTOR_LANES
#else
#define ROBORUN_VECTOR_LANES
#endif

#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace roborun::stages::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Floats>;

/// Bit i is lane i of the mask.
template <class Mask>
HWY_INLINE unsigned bits_of(Mask mask) {
  std::uint8_t bytes[8] = {};
  (void)hn::StoreMaskBits(Floats(), mask, bytes);
  return bytes[0];
}

}  // namespace roborun::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per instruction set
