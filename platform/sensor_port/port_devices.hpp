/// Sensors of firmware_if whose measurements other processes write to sensor ports. What is not well formed is refused and counted by reason; the
/// failsafe then sees a sensor that is silent.
#pragma once

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "firmware_if/depth_camera.hpp"
#include "firmware_if/imu.hpp"
#include "firmware_if/lidar.hpp"
#include "firmware_if/odometry.hpp"
#include "platform/sensor_port/port_reader.hpp"

namespace roborun::sensor_port {

/// Why samples were refused. Never decrease.
struct PortRefusals {
  std::uint64_t
      size{};  ///< Of an image or cloud: not that of its payload, or more than the port said at the start.
  std::uint64_t optics{};  ///< Intrinsics, ranges or mount: not finite, or impossible.
  std::uint64_t values{};  ///< Not finite, or no rotation.
  std::uint64_t
      backwards{};  ///< Stamp not after the one before: the writer's clock jumped. Believed again from the next one on.
};

/// What all ports of a run share: stamps count from when CLOCK_MONOTONIC showed `epoch`.
struct PortClock {
  Nanos epoch{};
};

/// Reader, stamps, mount and refusals of one device. A mount is that of the first sample: later ones with another are refused.
class PortDevice {
 public:
  /// As PortReader::open().
  [[nodiscard]] std::string open(const std::string& path, std::uint32_t kind, const PortClock& clock);
  [[nodiscard]] PortReader& reader() noexcept { return reader_; }
  [[nodiscard]] const PortReader& reader() const noexcept { return reader_; }
  [[nodiscard]] const PortRefusals& refusals() const noexcept { return refusals_; }
  /// A silence that lasts longer is counted. Before the first read.
  void set_patience(Nanos patience) noexcept { patience_ = patience; }
  /// Silences between two samples, and the one since the newest if it is as long at `now`.
  [[nodiscard]] std::uint64_t silences(MonotonicTime now) const noexcept {
    return silences_ + (last_ != MonotonicTime::min() && now - last_ > patience_ ? 1 : 0);
  }
  /// Of the newest sample whose stamp was read; the least there is before the first.
  [[nodiscard]] MonotonicTime newest() const noexcept { return last_; }

 protected:
  ~PortDevice() = default;
  /// The sample and its stamp on the run's clock, or nothing: the clock went back.
  template <typename Sample>
  [[nodiscard]] std::optional<MonotonicTime> take(const PortSample& port, Sample& sample) noexcept {
    std::memcpy(&sample, port.sample.data(), sizeof sample);
    return stamp_of(port, sample.at.stamp_ns);
  }
  /// Samples of this device may share an instant.
  void allow_equal_stamps() noexcept { may_repeat_ = true; }

  [[nodiscard]] bool has_mount(const roborun_port_mount& mount) noexcept;

  PortReader reader_;
  PortRefusals refusals_{};
  firmware_if::CameraMount mount_{};

 private:
  [[nodiscard]] std::optional<MonotonicTime> stamp_of(const PortSample& port, std::int64_t stamp_ns) noexcept;

  bool is_mounted_{false};
  bool may_repeat_{false};
  PortClock clock_{};
  Nanos patience_{500'000'000};
  std::uint64_t silences_{0};
  std::uint64_t dropped_before_{0};
  MonotonicTime last_ = MonotonicTime::min();
};

/// Images of any size from 8 x 8 to what the port has room for. The optical axis comes to the middle by leaving out columns and rows on one side
/// (less than half a pixel of it is left).
class PortDepthCamera final : public firmware_if::DepthCamera, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override;
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }

 private:
  std::vector<float> depth_m_;
};

/// Points with their times are taken as they are: whoever knows the vehicle's motion during the sweep takes it out before.
class PortLidar final : public firmware_if::Lidar, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override;
  [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }

 private:
  std::vector<std::array<float, 3>> points_L_m_;
};

class PortImu final : public firmware_if::Imu, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  [[nodiscard]] Status read(firmware_if::ImuSample& sample) noexcept override;
};

class PortOdometry final : public firmware_if::Odometry, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  [[nodiscard]] Status read(firmware_if::OdometrySample& sample) noexcept override;
};

}  // namespace roborun::sensor_port
