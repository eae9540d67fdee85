/// A vector of bounded size inside its owner.
#pragma once

#include <array>
#include <cstddef>

namespace roborun::core {

/// Up to N elements, contiguous, never on the heap. push_back on a full one changes nothing and returns
/// false. Indexing past size() is a bug of the caller. RT-safe: every call O(1).
template <typename T, std::size_t N>
class StaticVector {
 public:
  using value_type = T;

  [[nodiscard]] bool push_back(const T& value) noexcept {
    if (size_ == N) return false;
    items_[size_++] = value;
    return true;
  }
  void clear() noexcept { size_ = 0; }
  /// Drops the elements from `count` on; a larger count changes nothing.
  void truncate(std::size_t count) noexcept { size_ = count < size_ ? count : size_; }

  [[nodiscard]] static constexpr std::size_t capacity() noexcept { return N; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] T& operator[](std::size_t i) noexcept { return items_[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return items_[i]; }
  [[nodiscard]] const T& back() const noexcept { return items_[size_ - 1]; }
  [[nodiscard]] T* begin() noexcept { return items_.data(); }
  [[nodiscard]] T* end() noexcept { return items_.data() + size_; }
  [[nodiscard]] const T* begin() const noexcept { return items_.data(); }
  [[nodiscard]] const T* end() const noexcept { return items_.data() + size_; }

 private:
  std::array<T, N> items_{};
  std::size_t size_{0};
};

}  // namespace roborun::core
