/// A source of place and speed that the filter refuses: does it at least agree with itself?
#pragma once

#include <optional>

#include "core/geometry/vector.hpp"
#include "firmware_if/time.hpp"

namespace roborun::stages {

/// A filter whose inertial sensors were spoilt refuses whatever is right. It knows that by a source which moves as it says that it
/// moves, for kPatience, while nothing of it fits. A sensor that is stuck, jumps or says nonsense does not.
class Witness {
 public:
  struct Sample {
    MonotonicTime stamp{};
    Vector3 p_m = Vector3::Zero();  ///< In any frame, and v_mps in the same.
    Vector3 v_mps = Vector3::Zero();
    double sigma_p_m{}, sigma_v_mps{};
  };
  static constexpr Nanos kPatience{600'000'000};
  static constexpr Nanos kForgotten{500'000'000};  ///< Between two samples.

  /// One more that was refused. For how long all were that agree with one another within `gate_sigma`, each with something new; zero:
  /// this one agrees with none. RT-safe: O(1).
  [[nodiscard]] Nanos refused(const Sample& sample, double gate_sigma) noexcept;
  /// A state that is wrong fits by chance, too: it takes three in a row.
  void accepted() noexcept {
    if (++accepted_ >= 3) first_.reset();
  }
  /// Between the last two samples; zero before.
  [[nodiscard]] const Vector3& acceleration_mps2() const noexcept { return acceleration_mps2_; }

 private:
  std::optional<Sample> first_;
  Sample last_{};
  int accepted_{0};                    ///< In a row.
  Vector3 moved_m_ = Vector3::Zero();  ///< Since the first, by what was said of the speed.
  Vector3 acceleration_mps2_ = Vector3::Zero();
};

}  // namespace roborun::stages
