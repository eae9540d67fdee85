#include "platform/sensor_port/port_navigation.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/geometry/math.hpp"

namespace roborun::sensor_port {
namespace {

// WGS 84.
constexpr double kEquator_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
// ISO 2533 up to 11 km.
constexpr double kSeaLevel_Pa = 101325.0;
constexpr double kLapseHeight_m = 288.15 / 0.0065;
constexpr double kExponent = 5.25588;

double prime_vertical_m(double sine) noexcept {
  return kEquator_m / std::sqrt(1.0 - kEccentricity2 * sine * sine);
}

/// Earth-centred, earth-fixed.
std::array<double, 3> earth_fixed_m(const EarthPlace& place) noexcept {
  const auto [s, c] = core::sin_cos(place.latitude_deg * core::kDegree);
  const auto [sl, cl] = core::sin_cos(place.longitude_deg * core::kDegree);
  const double n_m = prime_vertical_m(s);
  return {(n_m + place.height_m) * c * cl, (n_m + place.height_m) * c * sl,
          (n_m * (1.0 - kEccentricity2) + place.height_m) * s};
}

/// One standard deviation; a heading that is not known has none.
bool is_sigma(float sigma) noexcept { return std::isfinite(sigma) && sigma >= 0.0F; }

}  // namespace

bool is_on_earth(const EarthPlace& place) noexcept {
  return std::fabs(place.latitude_deg) <= 90.0 && std::fabs(place.longitude_deg) <= 180.0 &&
         place.height_m >= -1000.0 && place.height_m <= 20000.0;
}

LocalFrame::LocalFrame(const EarthPlace& origin) noexcept
    : origin_(origin), origin_E_m_(earth_fixed_m(origin)) {
  const auto [s, c] = core::sin_cos(origin.latitude_deg * core::kDegree);
  const auto [sl, cl] = core::sin_cos(origin.longitude_deg * core::kDegree);
  R_LE_ = {-sl, cl, 0.0, -s * cl, -s * sl, c, c * cl, c * sl, s};
}

std::array<double, 3> LocalFrame::to_local_m(const EarthPlace& place) const noexcept {
  const std::array<double, 3> p_E_m = earth_fixed_m(place);
  std::array<double, 3> local_m{};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t i = 0; i < 3; ++i) local_m[row] += R_LE_[3 * row + i] * (p_E_m[i] - origin_E_m_[i]);
  return local_m;
}

EarthPlace LocalFrame::to_earth(const std::array<double, 3>& p_m) const noexcept {
  std::array<double, 3> E_m = origin_E_m_;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t row = 0; row < 3; ++row) E_m[i] += R_LE_[3 * row + i] * p_m[row];
  const double axis_m = core::hypot2(E_m[0], E_m[1]);
  // Bowring's iteration; it converges by a factor of 300 a step.
  double latitude_rad = core::atan2(E_m[2], axis_m * (1.0 - kEccentricity2));
  double height_m = 0.0;
  for (int i = 0; i < 5; ++i) {
    const auto [s, c] = core::sin_cos(latitude_rad);
    const double n_m = prime_vertical_m(s);
    height_m = axis_m * c + E_m[2] * s - kEquator_m * kEquator_m / n_m;
    latitude_rad = core::atan2(E_m[2] + kEccentricity2 * n_m * s, axis_m);
  }
  return {latitude_rad / core::kDegree, core::atan2(E_m[1], E_m[0]) / core::kDegree, height_m};
}

std::string PortGnss::open(const std::string& path, const PortClock& clock,
                           const std::optional<EarthPlace>& origin) {
  frame_.reset();
  if (origin) frame_.emplace(*origin);
  return PortDevice::open(path, ROBORUN_PORT_GNSS, clock);
}

Status PortGnss::read(firmware_if::GnssFix& fix) noexcept {
  PortSample port;
  if (const Status status = reader_.next(port); status != Status::kOk) return status;
  roborun_port_gnss g;
  const auto stamp = take(port, g);
  if (!stamp) return Status::kNotReady;
  const EarthPlace place{g.latitude_deg, g.longitude_deg, g.height_m};
  const bool moves =
      std::all_of(std::begin(g.v_ENU_mps), std::end(g.v_ENU_mps), [](double v) { return std::isfinite(v); });
  const bool heads =
      std::isnan(g.heading_rad) || (std::isfinite(g.heading_rad) && is_sigma(g.sigma_heading_rad));
  if (!is_on_earth(place) || !moves || !heads || !is_sigma(g.sigma_horizontal_m) ||
      !is_sigma(g.sigma_vertical_m) || !is_sigma(g.sigma_speed_mps)) {
    ++refusals_.values;
    return Status::kNotReady;
  }
  if (!frame_) frame_.emplace(place);
  fix.stamp = *stamp;
  fix.sequence = g.at.sequence;
  fix.p_WB_m = frame_->to_local_m(place);
  std::copy_n(g.v_ENU_mps, 3, fix.v_WB_mps.begin());
  fix.heading_rad = g.heading_rad;
  fix.sigma_horizontal_m = static_cast<double>(g.sigma_horizontal_m);
  fix.sigma_vertical_m = static_cast<double>(g.sigma_vertical_m);
  fix.sigma_speed_mps = static_cast<double>(g.sigma_speed_mps);
  fix.sigma_heading_rad = static_cast<double>(g.sigma_heading_rad);
  return Status::kOk;
}

double pressure_altitude_m(double pressure_Pa) noexcept {
  if (!(pressure_Pa >= 20000.0 && pressure_Pa <= 120000.0)) return std::numeric_limits<double>::quiet_NaN();
  return kLapseHeight_m * (1.0 - core::exp(core::log(pressure_Pa / kSeaLevel_Pa) / kExponent));
}

double pressure_at(double altitude_m) noexcept {
  return kSeaLevel_Pa * core::exp(kExponent * core::log(1.0 - altitude_m / kLapseHeight_m));
}

std::string PortBarometer::open(const std::string& path, const PortClock& clock) {
  first_m_.reset();
  return PortDevice::open(path, ROBORUN_PORT_PRESSURE, clock);
}

Status PortBarometer::read(firmware_if::BarometerSample& sample) noexcept {
  PortSample port;
  if (const Status status = reader_.next(port); status != Status::kOk) return status;
  roborun_port_pressure p;
  const auto stamp = take(port, p);
  if (!stamp) return Status::kNotReady;
  const double altitude_m = pressure_altitude_m(p.pressure_Pa);
  if (!std::isfinite(altitude_m)) {
    ++refusals_.values;
    return Status::kNotReady;
  }
  if (!first_m_) first_m_ = altitude_m;
  sample.stamp = *stamp;
  sample.sequence = p.at.sequence;
  sample.altitude_m = altitude_m - *first_m_ + start_m_;
  return Status::kOk;
}

}  // namespace roborun::sensor_port
