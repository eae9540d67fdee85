/// An array with one element per enumerator, indexed by the enumerator: no cast at each use, and no index of
/// another enumeration by mistake.
#pragma once

#include <array>
#include <cstddef>

namespace roborun::core {

/// A std::array with that one operator more, so that loops, fill() and conversion to a std::array stay.
template <typename Enum, typename T, std::size_t Size>
struct EnumArray : std::array<T, Size> {
  using std::array<T, Size>::operator[];

  /// Precondition: `key` is an enumerator. RT-safe: O(1).
  [[nodiscard]] constexpr T& operator[](Enum key) noexcept { return (*this)[static_cast<std::size_t>(key)]; }
  [[nodiscard]] constexpr const T& operator[](Enum key) const noexcept {
    return (*this)[static_cast<std::size_t>(key)];
  }
};

}  // namespace roborun::core
