/// The navigation sensors of a vehicle on its DroneCAN bus, as devices of the runtime: RawIMU, Fix2 with the heading of two
/// antennas or of a magnetometer, StaticPressure, and a range finder that looks down.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/exchange/spsc_ring.hpp"
#include "core/geometry/vector.hpp"
#include "core/sensor_rig.hpp"
#include "firmware_if/barometer.hpp"
#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/bus_time.hpp"
#include "firmware_if/gnss.hpp"
#include "firmware_if/imu.hpp"
#include "platform/live/compass.hpp"
#include "platform/live/far_end.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

/// Each kind of sensor is believed of one node: the first that says it. On the ground another one may follow when it has been
/// silent; in flight none, another sensor is a jump. What cannot be is refused and counted, and the failsafe sees a sensor that
/// is silent.
///
/// Stamps: the message's own, where it has one and a master keeps the bus's time; else when it came, a fix kFixAge before that.
/// IMU: the means over the integration interval, which carry all bits; where a node does not integrate, the latest values.
///
/// Heading of a fix: of two antennas; where those have been silent for a second, of the magnetometer at the time of the fix, with
/// the vertical as is_flown() says it (before the flight: as the IMU does).
class BusSensors {
 public:
  /// Assumed of receivers without a shared clock: from the measurement to the bus.
  static constexpr Nanos kFixAge{100'000'000};

  /// `bus`: an end of it of its own, which outlives this. The world begins at `origin`, or at the first fix.
  BusSensors(firmware_if::CanBus& bus, const SensorRig& rig,
             const std::optional<sensor_port::EarthPlace>& origin);
  BusSensors(const BusSensors&) = delete;
  BusSensors& operator=(const BusSensors&) = delete;

  /// Takes what has come: once a minor frame, before the devices are read. RT-safe: at most 128 frames, no allocation.
  void hear(MonotonicTime now) noexcept;
  [[nodiscard]] firmware_if::Imu& imu() noexcept { return imu_; }
  [[nodiscard]] firmware_if::Gnss& gnss() noexcept { return gnss_; }
  [[nodiscard]] firmware_if::Barometer& barometer() noexcept { return pressure_; }
  /// The flight lane, at the end of a minor frame: the vertical in the body's axes, a unit vector.
  void set_up(const Vector3& up_B) noexcept { up_B_ = up_B; }
  /// Above what is straight below; NaN: unknown. None: there is no range finder.
  [[nodiscard]] std::optional<double> height_m(MonotonicTime now) const noexcept;

  /// As FarEnd::look(), after hear(): takes what the devices hold.
  void look(MonotonicTime now, std::vector<Need>& needs);
  void use(MonotonicTime now, std::vector<PortUse>& all) const;

 private:
  /// Who says one kind of message, and how it stands with that.
  struct Voice {
    const char* device;
    const char* message;
    Nanos patience;
    std::uint8_t node{0};  ///< 0: nobody yet.
    MonotonicTime heard = MonotonicTime::min();
    MonotonicTime stamp = MonotonicTime::min();  ///< Of the newest sample.
    std::uint64_t taken{0}, refused{0}, foreign{0}, silences{0};
    const char* refusal{nullptr};  ///< Why the newest one was refused; null: it was not.
  };
  template <typename Interface, typename Sample>
  class Device final : public Interface {
   public:
    [[nodiscard]] Status read(Sample& sample) noexcept override {
      return ring.pop(sample) ? Status::kOk : Status::kNotReady;
    }
    core::SpscRing<Sample, 32> ring;
  };
  /// What the compass said.
  struct Bearing {
    MonotonicTime stamp = MonotonicTime::min();
    Compass::Heading heading{};
  };
  /// Mean of what the IMU measured, and how often, over the last whole second on the ground.
  struct Rest {
    MonotonicTime begin{};
    std::uint64_t count{0};
    Vector3 sum_B_mps2 = Vector3::Zero();
    double rate_Hz{0.0};
    Vector3 mean_B_mps2 = Vector3::Zero();
    bool is_known{false};
  };

  void begin_at(const sensor_port::EarthPlace& origin) noexcept;
  void take(const firmware_if::dronecan::Transfer& transfer) noexcept;
  void take(const firmware_if::dronecan::RawImu& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::GnssFix2& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::GnssHeading& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::StaticPressure& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::MagneticFieldStrength& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::MagneticFieldStrength2& m, MonotonicTime came) noexcept;
  void take(const firmware_if::dronecan::RangeMeasurement& m, MonotonicTime came) noexcept;
  /// Gauss, forward, right, down.
  void take_field(const std::array<float, 3>& field_frd, MonotonicTime came) noexcept;
  /// It is of the node that is believed, and decodes.
  template <typename T>
  void hear_as(const firmware_if::dronecan::Transfer& transfer, Voice& voice) noexcept;
  /// Refuses with `why`, or accepts a sample that was measured at `stamp`.
  [[nodiscard]] static bool accept(Voice& voice, const char* why, MonotonicTime stamp) noexcept;
  [[nodiscard]] MonotonicTime measured_at(std::uint64_t usec, MonotonicTime came,
                                          MonotonicTime otherwise) const noexcept;
  /// The fix that waited for the heading of its epoch.
  void let_go() noexcept;
  void rest(MonotonicTime now) noexcept;
  [[nodiscard]] static Need need_of(Voice& voice, MonotonicTime now);
  [[nodiscard]] Need need_of_heading(MonotonicTime now);

  firmware_if::CanBus& bus_;
  bool has_gnss_, needs_heading_;
  std::array<firmware_if::dronecan::Reassembler::Session, 32> sessions_{};
  firmware_if::dronecan::Reassembler reassembler_;
  firmware_if::dronecan::BusTime time_;
  std::optional<sensor_port::LocalFrame> frame_;
  Voice imu_voice_{"imu", "RawIMU", Nanos{25'000'000}};
  Voice fix_voice_{"gnss", "Fix2", Nanos{1'000'000'000}};
  Voice heading_voice_{
      "heading",
      "ardupilot.gnss.Heading (a receiver with two antennas), nor MagneticFieldStrength (a magnetometer),",
      Nanos{1'000'000'000}};
  Voice field_voice_{"magnetometer", "MagneticFieldStrength", Nanos{500'000'000}};
  Voice range_voice_{"range", "range_sensor.Measurement", Nanos{500'000'000}};
  Voice pressure_voice_{"pressure", "StaticPressure", Nanos{500'000'000}};
  Device<firmware_if::Imu, firmware_if::ImuSample> imu_;
  Device<firmware_if::Gnss, firmware_if::GnssFix> gnss_;
  Device<firmware_if::Barometer, firmware_if::BarometerSample> pressure_;
  std::optional<firmware_if::GnssFix> waiting_;  ///< For its heading.
  MonotonicTime waits_since_{};
  std::uint8_t satellites_{0};
  Compass compass_;
  std::optional<std::uint8_t> magnetometer_;  ///< The first one of a node that has several.
  std::array<Bearing, 64> bearings_{};        ///< A ring.
  std::size_t next_bearing_{0};
  std::optional<Vector3> up_B_;
  double range_m_{0.0};  ///< Along the beam, of range_voice_.stamp.
  std::optional<double> first_altitude_m_;
  double start_m_{0.0};  ///< Height of where it stands.
  Rest rest_;
};

}  // namespace roborun::live
