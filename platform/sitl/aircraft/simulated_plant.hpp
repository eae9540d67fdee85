/// What a flight is in, and what it is told of it: vehicle, far end of the motors' bus, navigation sensors, and who takes pictures
/// on the way. Its own time.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "platform/sitl/aircraft/simulated_actuators.hpp"
#include "platform/sitl/fault/faulty_sensors.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"
#include "platform/sitl/sensors/lidar.hpp"
#include "platform/sitl/sensors/navigation_sensors.hpp"
#include "platform/sitl/vehicle/vehicle.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::sitl {

/// What is simulated, and how.
struct SimulatorConfig {
  DepthCameraConfig camera{};      ///< Six of them where there is no rig; with one, the noise of its cameras.
  std::optional<SensorRig> rig{};  ///< None: six cameras.
  LidarNoise lidar{};              ///< Of all LiDARs.
  std::vector<std::vector<LidarRay>>
      lidar_patterns{};  ///< By LiDAR of the rig; none or an empty one: its rings.
  NavigationSensorsConfig sensors{};
  WindConfig wind{};
};

/// The sensors that look at space.
[[nodiscard]] SensorRig rig_of(const SimulatorConfig& config) noexcept;

/// Told the true pose once a minor frame. Contract: expose() neither blocks nor allocates.
class ExposureSink {
 public:
  virtual ~ExposureSink() = default;
  virtual void expose(MonotonicTime now, const Pose& X_WB) noexcept = 0;
};

class SimulatedPlant {
 public:
  /// Stands on the ground at `ground_W`. `cameras` and what is outside must outlive it.
  SimulatedPlant(const VehicleModel& vehicle, const SimulatorConfig& config, const Vector3& ground_W,
                 std::uint64_t seed, Nanos minor_frame, ExposureSink& cameras,
                 const OutsideActuators& outside = {})
      : vehicle_(vehicle, config.wind, ground_W, seed),
        sensors_(NavigationSensors(config.sensors, seed)),
        has_odometry_(config.sensors.odometry != OdometryModel::kNone),
        cameras_(cameras),
        far_side_(seed, outside),
        minor_frame_(minor_frame) {
    vehicle_.set_ground(ground_W.z());
  }
  SimulatedPlant(const SimulatedPlant&) = delete;
  SimulatedPlant& operator=(const SimulatedPlant&) = delete;

  /// All that can fail is connected to the line, which must outlive the plant.
  void connect(const FaultLine& line) noexcept {
    faults_ = &line;
    sensors_.connect(&line);
    far_side_.connect(&line);
  }
  /// From now on it stands on what is below it in this world, which also hides the sky from its receiver and must outlive
  /// it; without one, on a plane at the height of its start.
  void stand_in(const World& world) noexcept {
    world_ = &world;
    sensors_.stand_in(world);
  }

  /// Its time begins here.
  void start(MonotonicTime now) noexcept { now_ = now; }
  [[nodiscard]] MonotonicTime now() const noexcept { return now_; }
  /// One minor frame.
  void step() noexcept {
    // What was sent at the end of a minor frame reaches the motors in the middle of the next one: four
    // throttles are on the bus for 0.13 ms, and an ESC has a cycle of its own.
    find_ground();
    vehicle_.step(minor_frame_ / 2);
    far_side_.advance(now_ + minor_frame_ / 2, vehicle_.state().battery_ratio, vehicle_);
    vehicle_.step(minor_frame_ / 2);
    now_ += minor_frame_;
    sensors_.sample(now_, vehicle_.state());
    cameras_.expose(now_, vehicle_.X_WB());
  }

  /// `dt` without the bus: the motors hear at once. Nobody looks.
  void move(Nanos dt, const firmware_if::MotorCommand& motors) noexcept {
    (void)vehicle_.command(motors);
    vehicle_.step(dt);
    now_ += dt;
  }
  /// About once a minor frame, where it is moved: ground, sensors, cameras.
  void look() noexcept {
    find_ground();
    sensors_.sample(now_, vehicle_.state());
    cameras_.expose(now_, vehicle_.X_WB());
  }

  /// IMU, receiver, barometer and odometry, as they are read.
  [[nodiscard]] FaultySensors& sensors() noexcept { return sensors_; }
  [[nodiscard]] bool has_odometry() const noexcept { return has_odometry_; }
  [[nodiscard]] SimulatedActuators& far_side() noexcept { return far_side_; }
  [[nodiscard]] const SimulatedActuators& far_side() const noexcept { return far_side_; }
  [[nodiscard]] const Vehicle& vehicle() const noexcept { return vehicle_; }
  void set_mean_wind(const Vector3& mean_W_mps) noexcept { vehicle_.set_mean_wind(mean_W_mps); }
  /// The simulator's operator always is heard, unless the link has a fault.
  [[nodiscard]] bool hears_operator() const noexcept {
    const FaultKind kind = faults_ != nullptr ? faults_->of(Component::kLink) : FaultKind::kNone;
    return kind == FaultKind::kNone ||
           (kind == FaultKind::kIntermittent &&
            !faults_->loses(Component::kLink, 0,
                            static_cast<std::uint64_t>(now_.time_since_epoch() / minor_frame_)));
  }

 private:
  void find_ground() noexcept {
    if (world_ == nullptr) return;
    // Looked for from a little above: legs that give way sink into what they stand on. What is inside of an obstacle
    // falls to the ground it was over before.
    constexpr double kAbove_m = 1e-3;
    const double ground_m = vehicle_.ground_m();
    Vector3 from_W = vehicle_.state().p_WB;
    from_W.z() = std::max(from_W.z(), ground_m) + kAbove_m;
    const double below_m = world_->ground_below_m(from_W);
    if (below_m < from_W.z()) vehicle_.set_ground(below_m);
  }

  Vehicle vehicle_;
  FaultySensors sensors_;
  bool has_odometry_;
  ExposureSink& cameras_;
  SimulatedActuators far_side_;
  Nanos minor_frame_;
  MonotonicTime now_{};
  const FaultLine* faults_{nullptr};
  const World* world_{nullptr};
};

}  // namespace roborun::sitl
