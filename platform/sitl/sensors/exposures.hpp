/// When a simulated sensor looks, from where, and when its picture is there: what depth cameras and LiDARs share.
#pragma once

#include <algorithm>
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
  MonotonicTime stamp{};    ///< When it truly was.
  MonotonicTime said{};     ///< The stamp that it carries.
  MonotonicTime arrival{};  ///< When its picture is there.
  std::uint32_t sequence{};
  Pose X_WS{};  ///< Of the sensor.
  bool lost{};  ///< It never arrives.
};

/// What a clock and a bus do to pictures; all 0: nothing.
struct TimingErrors {
  double late_s{};  ///< Mean of the latency beyond the least one; exponential, at most four times the mean.
  double
      offset_s{};  ///< One sigma of the constant error of the stamps, drawn from the seed, at most 3 sigma.
  double jitter_s{};  ///< One sigma of the error of each stamp besides, at most 3 sigma.
};

/// Whether a look is lost, when it arrives and what stamp it carries depends on (seed, stream, sequence) alone. No
/// stamp is later than the arrival. No allocation.
class Exposures {
 public:
  struct Config {
    double rate_Hz{};
    double latency_s{};
    double lost_ratio{};
    std::uint64_t seed{};
    std::uint64_t stream{};
    TimingErrors timing{};
  };
  static constexpr std::size_t kRing = 32;
  Exposures(const Config& config, const firmware_if::CameraMount& mount) noexcept
      : config_(config), mount_(mount) {}

  /// To be called at every minor frame with the true pose; takes a look when one is due, and says so.
  bool expose(MonotonicTime now, const Pose& X_WB) noexcept {
    now_ = now;
    if (now < next_) return false;
    next_ = now + from_seconds(1.0 / config_.rate_Hz);
    ++taken_;
    core::CounterRng rng(config_.seed, config_.stream);
    rng.seek(std::uint64_t{taken_});
    Exposure& e = ring_[taken_ % ring_.size()];
    e = {now,
         now,
         now + from_seconds(config_.latency_s),
         taken_,
         core::camera_pose(X_WB, mount_),
         rng.uniform() < config_.lost_ratio};
    if (config_.timing.late_s > 0.0) disturb(e);
    return true;
  }
  [[nodiscard]] std::uint32_t taken() const noexcept { return taken_; }
  /// The newest look that is there and was not handed out before, or null. Valid until 31 more were taken.
  [[nodiscard]] const Exposure* take() noexcept {
    for (std::uint32_t sequence = taken_; sequence > last_read_ && taken_ - sequence < ring_.size();
         --sequence) {
      const Exposure& e = ring_[sequence % ring_.size()];
      if (e.lost || e.arrival > now_) continue;
      last_read_ = sequence;
      return &e;
    }
    return nullptr;
  }
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept { return mount_; }

 private:
  void disturb(Exposure& e) const noexcept {
    const TimingErrors& t = config_.timing;
    core::CounterRng fixed(config_.seed, config_.stream + 0x100000U);
    const double offset_s = t.offset_s * std::clamp(fixed.normal(), -3.0, 3.0);
    core::CounterRng rng(config_.seed, config_.stream + 0x200000U);
    rng.seek(std::uint64_t{4} * e.sequence);
    const double jitter_s = t.jitter_s * std::clamp(rng.normal(), -3.0, 3.0);
    e.arrival += from_seconds(t.late_s * std::min(-core::log(1.0 - rng.uniform()), 4.0));
    e.said = std::min(e.stamp + from_seconds(offset_s + jitter_s), e.arrival);
  }

  Config config_;
  firmware_if::CameraMount mount_;
  std::array<Exposure, kRing> ring_{};
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
