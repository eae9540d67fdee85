/// The bit stream of DSDL: each value as little-endian bytes, the bits of a byte from the most significant
/// one, a last incomplete byte left-aligned in what is left. And IEEE 754 half precision.
/// Source: UAVCAN v0 specification, "Data serialization". All RT-safe, O(bits), constexpr.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace roborun::firmware_if::dronecan {

namespace detail {

template <unsigned kBits>
inline constexpr std::uint64_t kMask = kBits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << kBits) - 1;

/// The bits of a value in the order in which they leave, first bit most significant; and back.
template <unsigned kBits>
[[nodiscard]] constexpr std::uint64_t to_wire_order(std::uint64_t value) noexcept {
  std::uint64_t wire = 0;
  for (unsigned i = 0; i < kBits / 8; ++i) wire = (wire << 8U) | ((value >> (8U * i)) & 0xffU);
  constexpr unsigned kRest = kBits % 8;
  return kRest == 0 ? wire : (wire << kRest) | ((value >> (kBits - kRest)) & kMask<kRest>);
}
template <unsigned kBits>
[[nodiscard]] constexpr std::uint64_t from_wire_order(std::uint64_t wire) noexcept {
  constexpr unsigned kRest = kBits % 8;
  std::uint64_t value = 0;
  if constexpr (kRest != 0) value = (wire & kMask<kRest>) << (kBits - kRest);
  for (unsigned i = 0; i < kBits / 8; ++i) value |= ((wire >> (kBits - 8U * (i + 1))) & 0xffU) << (8U * i);
  return value;
}

}  // namespace detail

/// Writes into memory of its owner. What does not fit is dropped and ok() is false from then on.
class BitWriter {
 public:
  constexpr explicit BitWriter(std::span<std::uint8_t> out) noexcept : out_(out) {}

  template <unsigned kBits>
  requires(kBits >= 1 && kBits <= 56) constexpr void put(std::uint64_t value) noexcept {
    pending_ = (pending_ << kBits) | detail::to_wire_order<kBits>(value & detail::kMask<kBits>);
    pending_bits_ += kBits;
    while (pending_bits_ >= 8) {
      pending_bits_ -= 8;
      if (size_ >= out_.size()) {
        ok_ = false;
        return;
      }
      out_[size_++] = static_cast<std::uint8_t>(pending_ >> pending_bits_);
    }
  }
  /// Fills the last byte with zeros. Nothing may be written afterwards.
  constexpr void finish() noexcept {
    if (pending_bits_ != 0) {
      if (size_ >= out_.size()) {
        ok_ = false;
        return;
      }
      out_[size_++] = static_cast<std::uint8_t>(pending_ << (8U - pending_bits_));
    }
  }
  [[nodiscard]] constexpr bool ok() const noexcept { return ok_; }
  [[nodiscard]] constexpr std::size_t size_bytes() const noexcept { return size_; }

 private:
  std::span<std::uint8_t> out_;
  std::size_t size_{0};
  std::uint64_t pending_{0};
  unsigned pending_bits_{0};
  bool ok_{true};
};

/// Reads beyond the end give zero, and ok() is false from then on.
class BitReader {
 public:
  constexpr explicit BitReader(std::span<const std::uint8_t> in) noexcept : in_(in) {}

  template <unsigned kBits>
  requires(kBits >= 1 && kBits <= 56) [[nodiscard]] constexpr std::uint64_t get() noexcept {
    while (pending_bits_ < kBits) {
      if (next_ >= in_.size()) {
        ok_ = false;
        return 0;
      }
      pending_ = (pending_ << 8U) | in_[next_++];
      pending_bits_ += 8;
    }
    pending_bits_ -= kBits;
    return detail::from_wire_order<kBits>((pending_ >> pending_bits_) & detail::kMask<kBits>);
  }
  constexpr void fail() noexcept { ok_ = false; }
  [[nodiscard]] constexpr bool ok() const noexcept { return ok_; }
  [[nodiscard]] constexpr std::size_t remaining_bits() const noexcept {
    return 8 * (in_.size() - next_) + pending_bits_;
  }

 private:
  std::span<const std::uint8_t> in_;
  std::size_t next_{0};
  std::uint64_t pending_{0};
  unsigned pending_bits_{0};
  bool ok_{true};
};

/// Nearest half-precision number, ties to even. Finite values beyond +-65504 are clamped to it ("saturated"
/// in DSDL); infinities stay; NaN becomes a quiet NaN.
[[nodiscard]] constexpr std::uint16_t to_half(float value) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto sign = static_cast<std::uint16_t>((bits >> 16U) & 0x8000U);
  const std::uint32_t magnitude = bits & 0x7fffffffU;
  std::uint32_t half = 0;
  if (magnitude > 0x7f800000U) {
    half = 0x7e00U;
  } else if (magnitude == 0x7f800000U) {
    half = 0x7c00U;
  } else if (magnitude >= 0x477fe000U) {
    half = 0x7bffU;
  } else if (magnitude >= 0x38800000U) {  // normal: 2^-14 and above
    const std::uint32_t shifted = magnitude - 0x38000000U;
    half = (shifted + 0x0fffU + ((shifted >> 13U) & 1U)) >> 13U;
  } else if (magnitude >= 0x33000000U) {  // subnormal: the significand moves right
    const std::uint32_t significand = (magnitude & 0x007fffffU) | 0x00800000U;
    const unsigned shift = 126U - (magnitude >> 23U);
    half = (significand + (1U << (shift - 1U)) - 1U + ((significand >> shift) & 1U)) >> shift;
  }
  return static_cast<std::uint16_t>(sign | half);
}

/// Exact.
[[nodiscard]] constexpr float from_half(std::uint16_t half) noexcept {
  const std::uint32_t sign = (half & 0x8000U) << 16U;
  const std::uint32_t exponent = (half >> 10U) & 0x1fU;
  const std::uint32_t significand = half & 0x3ffU;
  if (exponent == 0x1f) return std::bit_cast<float>(sign | 0x7f800000U | (significand << 13U));
  if (exponent != 0) return std::bit_cast<float>(sign | ((exponent + 112U) << 23U) | (significand << 13U));
  const float tiny = static_cast<float>(significand) * 0x1p-24F;
  return sign != 0 ? -tiny : tiny;
}

}  // namespace roborun::firmware_if::dronecan
