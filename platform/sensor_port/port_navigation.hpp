/// Satellite navigation and air pressure, as other processes write them to sensor ports.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "firmware_if/barometer.hpp"
#include "firmware_if/gnss.hpp"
#include "platform/sensor_port/port_devices.hpp"

namespace roborun::sensor_port {

/// A place on the earth: WGS 84, height above the ellipsoid.
struct EarthPlace {
  double latitude_deg{}, longitude_deg{}, height_m{};
};
/// Within +-90 and +-180 degrees, and from -1 to 20 km high.
[[nodiscard]] bool is_on_earth(const EarthPlace& place) noexcept;

/// East, north, up from an origin. RT-safe: O(1); same bits everywhere.
class LocalFrame {
 public:
  explicit LocalFrame(const EarthPlace& origin) noexcept;
  [[nodiscard]] std::array<double, 3> to_local_m(const EarthPlace& place) const noexcept;
  /// The inverse, within 1 mm for places less than 20 km away.
  [[nodiscard]] EarthPlace to_earth(const std::array<double, 3>& p_m) const noexcept;

 private:
  EarthPlace origin_;
  std::array<double, 3> origin_E_m_{};
  std::array<double, 9> R_LE_{};  ///< From earth-fixed axes to east, north, up.
};

/// Without a given origin the world begins at the first fix.
class PortGnss final : public firmware_if::Gnss, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock,
                                 const std::optional<EarthPlace>& origin = std::nullopt);
  [[nodiscard]] Status read(firmware_if::GnssFix& fix) noexcept override;

 private:
  std::optional<LocalFrame> frame_;
};

/// The standard atmosphere (ISO 2533) up to 11 km. NaN for what is no pressure of the air there.
[[nodiscard]] double pressure_altitude_m(double pressure_Pa) noexcept;
[[nodiscard]] double pressure_at(double altitude_m) noexcept;

/// The first sample says what the pressure is where the vehicle stands: the weather's part of it is gone from then on.
class PortBarometer final : public firmware_if::Barometer, public PortDevice {
 public:
  [[nodiscard]] std::string open(const std::string& path, const PortClock& clock);
  /// Where it stands: height in the world, of the first sample. Before the first read that counts.
  void stands_at(double height_m) noexcept { start_m_ = height_m; }
  [[nodiscard]] Status read(firmware_if::BarometerSample& sample) noexcept override;

 private:
  double start_m_{0.0};
  std::optional<double> first_m_;
};

}  // namespace roborun::sensor_port
