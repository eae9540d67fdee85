/// A vehicle that an autopilot at the far end of a MAVLink link flies; its depth images come over sensor ports.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/exchange/spsc_ring.hpp"
#include "core/executive/slot_statistics.hpp"
#include "core/sensor_rig.hpp"
#include "firmware_if/clock.hpp"
#include "firmware_if/mavlink/companion.hpp"
#include "platform/live/far_end.hpp"
#include "platform/live/port_pictures.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/mavlink/signed_end.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

/// The world is the autopilot's local frame. Its kill switch, its operator's link and its motors are its own affair: what it
/// does about them is a change of its mode, or silence.
class MavlinkAircraft final : public FarEnd {
 public:
  /// `origin`: where the autopilot's frame has to begin; none: anywhere. `key`: nothing unsigned is heard, nothing unsigned is
  /// sent. `clock` outlives it.
  MavlinkAircraft(const mavlink::LinkAddress& link, const firmware_if::mavlink::Companion::Config& config,
                  const sensor_port::VehiclePorts& ports, const SensorRig& rig,
                  const firmware_if::Clock& clock, Nanos epoch,
                  const std::optional<sensor_port::EarthPlace>& origin,
                  const std::optional<firmware_if::mavlink::SecretKey>& key)
      : pictures_(ports, rig, {epoch}),
        clock_(clock),
        link_(link),
        signed_(key ? std::make_unique<mavlink::SignedEnd>(*key, kLinkId) : nullptr),
        companion_(config, signed_ ? signed_->signer() : nullptr, signed_ ? signed_->verifier() : nullptr),
        origin_(origin) {}
  MavlinkAircraft(const MavlinkAircraft&) = delete;
  MavlinkAircraft& operator=(const MavlinkAircraft&) = delete;

  /// Greets the autopilot, asks it, and sets what may be set: nothing is armed.
  [[nodiscard]] std::vector<Need> look(MonotonicTime now) override;
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept override {
    return pictures_.cameras();
  }
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> watched() noexcept override {
    return pictures_.watched();
  }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept override { return pictures_.lidars(); }
  [[nodiscard]] std::vector<PortUse> use(MonotonicTime now) const override;
  [[nodiscard]] const firmware_if::mavlink::Companion& companion() const noexcept { return companion_; }
  /// Of set-points, while it is ours: from the validity of the newest state until the bytes are the operating system's.
  [[nodiscard]] const core::DurationHistogram& latency() const noexcept { return latency_; }

  /// Of the autopilot, as it told before the lanes ran.
  [[nodiscard]] std::optional<sensor_port::EarthPlace> origin() const override;
  [[nodiscard]] std::uint8_t sysid() const noexcept override { return companion_.autopilot_sysid(); }
  [[nodiscard]] bool asked(firmware_if::mavlink::GoalRequest& request) noexcept override {
    return asked_.pop(request);
  }
  void tell(const firmware_if::mavlink::Statustext& line) noexcept override { (void)lines_.push(line); }
  void tell(const firmware_if::mavlink::CommandAck& ack) noexcept override { (void)answers_.push(ack); }

  void release_package() noexcept override { releases_asked_.fetch_add(1, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t packages_released() const noexcept override {
    return companion_.counters().releases;
  }
  void begin_frame(MonotonicTime now) noexcept override;
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return none_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return none_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return none_; }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return none_; }
  [[nodiscard]] firmware_if::Autopilot* autopilot() noexcept override { return &companion_; }
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override {
    (void)now;
    return {companion_.report().battery_ratio, Nanos{0}, true, false};
  }
  void terminate() noexcept override { companion_.terminate(); }
  void disarm() noexcept override { companion_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override;

 private:
  /// What nobody asks for where an autopilot flies.
  struct None final : firmware_if::Imu, firmware_if::Gnss, firmware_if::Barometer, firmware_if::Motors {
    [[nodiscard]] Status read(firmware_if::ImuSample&) noexcept override { return Status::kNotReady; }
    [[nodiscard]] Status read(firmware_if::GnssFix&) noexcept override { return Status::kNotReady; }
    [[nodiscard]] Status read(firmware_if::BarometerSample&) noexcept override { return Status::kNotReady; }
    [[nodiscard]] Status command(const firmware_if::MotorCommand&) noexcept override {
      return Status::kNotReady;
    }
  };

  [[nodiscard]] Need look_at_origin() const;

  PortPictures pictures_;
  const firmware_if::Clock& clock_;
  mavlink::Link link_;
  static constexpr std::uint8_t kLinkId = 0;
  std::unique_ptr<mavlink::SignedEnd> signed_;
  firmware_if::mavlink::Companion companion_;
  std::array<std::uint8_t, 4096> bytes_{};
  std::uint64_t states_{0}, silences_{0}, set_points_{0};
  core::DurationHistogram latency_;
  MonotonicTime state_at_{};
  bool is_silent_{false};
  std::optional<sensor_port::EarthPlace> origin_;
  std::atomic<std::uint32_t> releases_asked_{0};
  std::uint32_t releases_begun_{0};
  // Between the thread that watches and the flight lane.
  core::SpscRing<firmware_if::mavlink::GoalRequest, 16> asked_;
  core::SpscRing<firmware_if::mavlink::Statustext, 64> lines_;
  core::SpscRing<firmware_if::mavlink::CommandAck, 16> answers_;
  None none_;
};

}  // namespace roborun::live
