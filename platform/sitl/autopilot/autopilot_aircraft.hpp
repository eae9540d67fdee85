/// A simulated vehicle that a fake autopilot flies, and the link between it and the runtime, all in lockstep.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_if/mavlink/companion.hpp"
#include "platform/flight/aircraft.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"
#include "platform/sitl/autopilot/fake_autopilot.hpp"

namespace roborun::sitl {

/// Bytes under way on a serial line: they arrive `delay` after they were sent, in order. No allocation.
class SerialLine {
 public:
  explicit SerialLine(Nanos delay) noexcept : delay_(delay) {}
  /// What does not fit any more is lost: a line that nobody reads.
  void send(MonotonicTime now, std::span<const std::uint8_t> bytes) noexcept;
  /// What has arrived by now, at most one chunk of it; empty: nothing. Valid until the next call.
  [[nodiscard]] std::span<const std::uint8_t> receive(MonotonicTime now) noexcept;
  /// Cable pulled: what is under way and what is sent from now on is lost, until it is plugged in again.
  void cut(bool is_cut) noexcept { cut_ = is_cut; }

 private:
  struct Chunk {
    MonotonicTime due{};
    std::size_t bytes{};
    std::array<std::uint8_t, 4096> data;
  };
  static constexpr std::size_t kMost = 8;
  Nanos delay_;
  std::array<Chunk, kMost> chunk_{};
  std::size_t first_{0}, count_{0};
  bool cut_{false};
};

class AutopilotAircraft final : public flight::Aircraft {
 public:
  static constexpr Nanos kDelay{5'000'000};  ///< Each way: 921600 baud and two operating systems.

  /// `body` outlives it and is stepped by it alone.
  AutopilotAircraft(SimulatedAircraft& body, const VehicleModel& vehicle, Nanos minor_frame,
                    const firmware_if::mavlink::Companion::Config& config) noexcept
      : body_(body),
        fake_(config.kind, vehicle, minor_frame),
        companion_(config),
        minor_frame_(minor_frame) {}

  void begin_frame(MonotonicTime now) noexcept override;
  [[nodiscard]] firmware_if::Imu& imu() noexcept override { return body_.imu(); }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept override { return body_.gnss(); }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept override { return body_.barometer(); }
  [[nodiscard]] firmware_if::Motors& motors() noexcept override { return body_.motors(); }
  [[nodiscard]] firmware_if::Autopilot* autopilot() noexcept override { return &companion_; }
  /// Its motors and their bus are the autopilot's affair: how old its state is shows elsewhere.
  [[nodiscard]] flight::AircraftHealth health(MonotonicTime now) noexcept override;
  /// The autopilot's motors: it is asked to stop them, in vain where it is not ours (Autopilot::terminate()).
  void terminate() noexcept override { companion_.terminate(); }
  void disarm() noexcept override { companion_.disarm(); }
  void end_frame(MonotonicTime now) noexcept override;

  [[nodiscard]] FakeAutopilot& fake() noexcept { return fake_; }
  [[nodiscard]] firmware_if::mavlink::Companion& companion() noexcept { return companion_; }
  /// Both ways.
  void cut(bool is_cut) noexcept {
    up_.cut(is_cut);
    down_.cut(is_cut);
  }

 private:
  SimulatedAircraft& body_;
  FakeAutopilot fake_;
  firmware_if::mavlink::Companion companion_;
  Nanos minor_frame_;
  MonotonicTime now_{};
  SerialLine up_{kDelay}, down_{kDelay};
};

}  // namespace roborun::sitl
