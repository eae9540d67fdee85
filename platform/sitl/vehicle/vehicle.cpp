#include "platform/sitl/vehicle/vehicle.hpp"

#include <cmath>

#include "core/energy_model.hpp"
#include "core/geometry/math.hpp"

namespace roborun::sitl {
namespace {

constexpr double kMaxSubstep_s = 1.25e-3;
constexpr double kLegs_mps2 = 30.0;

}  // namespace

Vehicle::Vehicle(const VehicleModel& model, const WindConfig& wind, const Vector3& p_WB,
                 std::uint64_t seed) noexcept
    : model_(model), wind_(wind), rng_(seed, 2) {
  state_.p_WB = p_WB;
}

Status Vehicle::command(const firmware_if::MotorCommand& command) noexcept {
  for (const double ratio : command.thrust_ratio) {
    if (!(ratio >= 0.0 && ratio <= 1.0)) return Status::kInvalidArgument;
  }
  command_ = command;
  return Status::kOk;
}

void Vehicle::step(Nanos dt) noexcept {
  const double dt_s = seconds(dt);
  const double decay = core::exp(-dt_s / wind_.correlation_s);
  const double drive = std::sqrt(1.0 - decay * decay) * wind_.gust_mps;
  for (int i = 0; i < 3; ++i) {
    gust_W_mps_[i] = decay * gust_W_mps_[i] + drive * (i == 2 ? 0.5 : 1.0) * rng_.normal();
  }
  wind_W_mps_ = wind_.mean_W_mps + gust_W_mps_;
  const int count = static_cast<int>(std::ceil(dt_s / kMaxSubstep_s - 1e-9));
  for (int i = 0; i < count; ++i) substep(dt_s / count);
}

void Vehicle::substep(double dt_s) noexcept {
  VehicleState& s = state_;
  const double lag = 1.0 - core::exp(-dt_s / model_.motor_lag_s);
  std::array<double, 4> thrust_N{};
  double total_N = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double wanted = s.battery_ratio > 0.0 ? command_.thrust_ratio[i] : 0.0;
    s.thrust_ratio[i] += lag * (wanted - s.thrust_ratio[i]);
    thrust_N[i] = s.thrust_ratio[i] * model_.max_thrust_N;
    total_N += thrust_N[i];
  }

  const Matrix3 R_WB = s.q_WB.toRotationMatrix();
  const Vector3 air_W_mps = s.v_WB - wind_W_mps_;
  const Vector3 drag_W_N =
      -(model_.drag_linear_Nspm + model_.drag_quadratic_Ns2pm2 * air_W_mps.norm()) * air_W_mps;
  s.a_WB = (R_WB.col(2) * total_N + drag_W_N) / model_.mass_kg - Vector3(0.0, 0.0, core::kGravity_mps2);

  // Front left, front right, rear left, rear right; front left and rear right push the body
  // counter-clockwise.
  const double arm_m = model_.arm_m;
  const Vector3 torque_B_Nm(arm_m * (thrust_N[0] - thrust_N[1] + thrust_N[2] - thrust_N[3]),
                            arm_m * (-thrust_N[0] - thrust_N[1] + thrust_N[2] + thrust_N[3]),
                            model_.yaw_torque_m * (thrust_N[0] - thrust_N[1] - thrust_N[2] + thrust_N[3]));
  const Vector3 inertia_kgm2 = model_.inertia_kgm2();
  const Vector3 momentum = inertia_kgm2.cwiseProduct(s.w_WB_B);
  const Vector3 w_dot = (torque_B_Nm - model_.drag_angular_Nms * s.w_WB_B - s.w_WB_B.cross(momentum))
                            .cwiseQuotient(inertia_kgm2);

  s.on_ground = s.p_WB.z() <= ground_m_ && s.a_WB.z() <= 0.0;
  if (s.on_ground && !s.v_WB.isZero(0.0)) {
    // The legs give way while they take up its speed: an accelerometer feels the touch-down.
    const Vector3 stop_W_mps2 = -s.v_WB / dt_s;
    s.a_WB = stop_W_mps2 * std::fmin(1.0, kLegs_mps2 / stop_W_mps2.norm());
    s.v_WB += dt_s * s.a_WB;
    s.p_WB += dt_s * s.v_WB;
    s.w_WB_B.setZero();
  } else if (s.on_ground) {
    // They hold it: no sliding, no tipping over.
    s.p_WB.z() = ground_m_;
    s.v_WB.setZero();
    s.a_WB.setZero();
    s.w_WB_B.setZero();
  } else {
    s.v_WB += dt_s * s.a_WB;
    s.p_WB += dt_s * s.v_WB;
    s.w_WB_B += dt_s * w_dot;
    const Vector3 half = 0.5 * dt_s * s.w_WB_B;
    s.q_WB = (s.q_WB * Quaternion(1.0, half.x(), half.y(), half.z())).normalized();
  }

  const double axial_mps = R_WB.col(2).dot(air_W_mps);
  s.power_W = model_.avionics_W;
  for (const double t_N : thrust_N) s.power_W += rotor_power_W(model_, t_N, axial_mps);
  s.energy_J += s.power_W * dt_s;
  s.battery_ratio = std::fmax(0.0, 1.0 - s.energy_J / model_.battery_J);
}

}  // namespace roborun::sitl
