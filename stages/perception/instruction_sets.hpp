/// The vector instruction sets that the kernels of this folder are compiled for. The kernels give the same
/// bits on all of them. A source with kernels includes this header before any of Highway's.
#pragma once

#include <cstdint>

// Eight lanes are all there is to do: wider registers were slower than AVX2. GCC 12 crashes on Arm's SVE.
#define HWY_DISABLED_TARGETS (HWY_AVX3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)

namespace roborun::stages {

/// Returns the sets of which this machine can use one, one bit each.
[[nodiscard]] std::int64_t kernel_instruction_sets() noexcept;

/// Restricts all kernels to these sets (for tests); ~0 lifts the restriction. Not thread-safe.
void use_kernel_instruction_sets(std::int64_t sets) noexcept;

}  // namespace roborun::stages
