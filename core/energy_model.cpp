#include "core/energy_model.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun {
namespace {

constexpr double kAirDensity_kgpm3 = 1.225;
constexpr double kRotors = 4.0;

}  // namespace

double rotor_power_W(const VehicleModel& vehicle, double thrust_N, double axial_mps) noexcept {
  const double area_m2 = core::kPi * vehicle.rotor_radius_m * vehicle.rotor_radius_m;
  const double half_mps = 0.5 * std::fmax(axial_mps, 0.0);
  const double induced_mps =
      -half_mps + std::sqrt(half_mps * half_mps + thrust_N / (2.0 * kAirDensity_kgpm3 * area_m2));
  return thrust_N * (induced_mps + std::fmax(axial_mps, 0.0)) / vehicle.efficiency_ratio;
}

EnergyPerMetre energy_per_metre(const VehicleModel& vehicle, double speed_mps) noexcept {
  const double weight_N = vehicle.mass_kg * core::kGravity_mps2;
  const double drag_N = vehicle.mass_kg * drag_mps2(vehicle, speed_mps);
  const double thrust_N = std::sqrt(weight_N * weight_N + drag_N * drag_N);
  const double axial_mps = speed_mps * drag_N / thrust_N;
  return {kRotors * rotor_power_W(vehicle, thrust_N / kRotors, axial_mps) / speed_mps,
          vehicle.avionics_W / speed_mps};
}

double cheapest_speed_mps(const VehicleModel& vehicle) noexcept {
  // Golden sections: the energy of a metre falls up to its only minimum, and rises from there on.
  constexpr double kSlowest_mps = 0.1, kFastest_mps = 30.0;
  constexpr double kGolden = 0.61803398874989485;
  constexpr int kSteps = 28;  // 30 m/s times golden^28 is 4e-5 m/s
  const auto cost_Jpm = [&vehicle](double v_mps) { return energy_per_metre(vehicle, v_mps).total_Jpm(); };
  double low = kSlowest_mps, high = kFastest_mps;
  double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
  double left_Jpm = cost_Jpm(left), right_Jpm = cost_Jpm(right);
  for (int i = 0; i < kSteps; ++i) {
    if (left_Jpm <= right_Jpm) {
      high = right;
      right = left;
      right_Jpm = left_Jpm;
      left = high - kGolden * (high - low);
      left_Jpm = cost_Jpm(left);
    } else {
      low = left;
      left = right;
      left_Jpm = right_Jpm;
      right = low + kGolden * (high - low);
      right_Jpm = cost_Jpm(right);
    }
  }
  return 0.5 * (low + high);
}

double hover_power_W(const VehicleModel& vehicle) noexcept {
  const double thrust_N = vehicle.mass_kg * core::kGravity_mps2 / kRotors;
  return vehicle.avionics_W + kRotors * rotor_power_W(vehicle, thrust_N, 0.0);
}

}  // namespace roborun
