/// When a simulated sensor looks, from where, and when its picture is there: what depth cameras and LiDARs share.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/camera_pose.hpp"
#include "core/geometry/vector.hpp"
#include "core/random/counter_rng.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/time.hpp"

namespace roborun::sitl {

/// One look of a sensor.
struct Exposure {
  MonotonicTime stamp{};
  std::uint32_t sequence{};
  Pose X_WS{};  ///< Of the sensor.
  bool lost{};  ///< It never arrives.
};

/// Whether a look is lost depends on (seed, stream, sequence) alone. No allocation.
class Exposures {
 public:
  struct Config {
    double rate_Hz{};
    double latency_s{};
    double lost_ratio{};
    std::uint64_t seed{};
    std::uint64_t stream{};
  };
  Exposures(const Config& config, const firmware_if::CameraMount& mount) noexcept
      : config_(config), mount_(mount) {}

  /// To be called at every minor frame with the true pose; takes a look when one is due.
  void expose(MonotonicTime now, const Pose& X_WB) noexcept {
    now_ = now;
    if (now < next_) return;
    next_ = now + from_seconds(1.0 / config_.rate_Hz);
    ++taken_;
    core::CounterRng rng(config_.seed, config_.stream);
    rng.seek(std::uint64_t{taken_});
    ring_[taken_ % ring_.size()] = {now, taken_, core::camera_pose(X_WB, mount_),
                                    rng.uniform() < config_.lost_ratio};
  }
  /// The newest look that is there and was not handed out before, or null. Valid until 31 more were taken.
  [[nodiscard]] const Exposure* take() noexcept {
    const Nanos latency = from_seconds(config_.latency_s);
    for (std::uint32_t sequence = taken_; sequence > last_read_ && taken_ - sequence < ring_.size();
         --sequence) {
      const Exposure& e = ring_[sequence % ring_.size()];
      if (e.lost || e.stamp + latency > now_) continue;
      last_read_ = sequence;
      return &e;
    }
    return nullptr;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept { return mount_; }

 private:
  Config config_;
  firmware_if::CameraMount mount_;
  std::array<Exposure, 32> ring_{};
  std::uint32_t taken_{0};
  std::uint32_t last_read_{0};  ///< Sequence of the newest look handed out, 0: none.
  MonotonicTime now_{};
  MonotonicTime next_{};
};

/// Standard normal, nearly, and bounded, as a matcher's error is: the sum of four 10-bit uniforms of `bits`.
[[nodiscard]] inline double bounded_normal(std::uint64_t bits) noexcept {
  const double sum = static_cast<double>((bits & 1023U) + ((bits >> 10U) & 1023U) + ((bits >> 20U) & 1023U) +
                                         ((bits >> 30U) & 1023U));
  return (sum - 2046.0) / 591.2;
}

}  // namespace roborun::sitl
