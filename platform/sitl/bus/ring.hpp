/// A first-in first-out queue of fixed size.
#pragma once

#include <array>
#include <cstddef>

namespace roborun::sitl {

template <typename T, std::size_t kCapacity>
class Ring {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t room() const noexcept { return kCapacity - size_; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// Precondition: not empty.
  [[nodiscard]] T& front() noexcept { return items_[first_]; }
  void pop() noexcept {
    first_ = (first_ + 1) % kCapacity;
    --size_;
  }
  void clear() noexcept { size_ = 0; }
  /// False: full, nothing was changed.
  [[nodiscard]] bool push(const T& item) noexcept {
    if (size_ == kCapacity) return false;
    items_[(first_ + size_++) % kCapacity] = item;
    return true;
  }

 private:
  std::array<T, kCapacity> items_{};
  std::size_t first_{0};
  std::size_t size_{0};
};

}  // namespace roborun::sitl
