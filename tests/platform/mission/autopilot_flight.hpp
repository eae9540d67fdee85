/// A flight through environment 14 in lockstep that a fake autopilot flies, without judge: faults are given to it, and the
/// vehicle is looked at from outside.
#pragma once

#include <deque>
#include <vector>

#include "core/executive/cost_profile.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/flight/lockstep_flight.hpp"
#include "platform/mission/flight_setup.hpp"
#include "platform/mission/mission.hpp"
#include "platform/sitl/aircraft/camera_rig.hpp"
#include "platform/sitl/autopilot/autopilot_aircraft.hpp"
#include "platform/sitl/world/generator.hpp"
#include "platform/sitl/world/world_maker.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::mission {

inline sitl::World middle_world(std::uint64_t seed = 1) {
  return sitl::generate(sitl::environment("14").knobs, sitl::mission_of("package_delivery"), seed);
}

inline MissionConfig autopilot_config(AutopilotKind kind, bool tuned = false) {
  MissionConfig config;
  set_vehicle(config, vehicle::load_vehicle("paper"));
  const board::Profile paper = board::paper();
  config.flight.costs = paper.costs;
  config.flight.model = paper.model;
  config.autopilot = AutopilotChoice{kind, tuned};
  return config;
}

/// A vehicle that sees 10 m and decides ten times per second: what its autopilot's stop needs is all that there is.
inline MissionConfig near_sighted_config(AutopilotKind kind) {
  constexpr double kOfPaper = 0.1;
  MissionConfig config = autopilot_config(kind);
  set_vehicle(config, vehicle::load_vehicle("x500-six"));
  config.flight.costs = core::slower(config.flight.costs, kOfPaper);
  for (governor::LatencyModel& model : config.flight.model) model = governor::slower(model, kOfPaper);
  return config;
}

/// Trees on all sides of it, one per 5 m.
inline sitl::World forest_world(std::uint64_t seed) {
  sitl::WorldMakerOptions options;
  options.radius_m = vehicle::load_vehicle("x500-six").model.radius_m;
  options.spacing_m = 5.0;
  return sitl::World(sitl::make_world(sitl::WorldKind::kForest, seed, options));
}

class AutopilotFlight {
 public:
  AutopilotFlight(const sitl::World& world, const MissionConfig& config, bool stops_straight = true)
      : flight_config_(configured(world, config, stops_straight)),
        rig_(world, config.simulator, config.seed, sitl::Readers::kTwo),
        body_(flight_config_.vehicle, config.simulator, ground_below(world), config.seed,
              config.flight.minor_frame, rig_),
        aircraft_(body_, config.flight.vehicle, config.flight.minor_frame,
                  companion_config(*config.autopilot, config.flight.vehicle)),
        cameras_(switched(rig_.cameras())),
        watched_(switched(rig_.watched())),
        setup_(flight_config_, config.backends, image_limits(config)),
        flight_(flight_config_, aircraft_, cameras_, setup_.parts(watched_), setup_.arena(), rig_.lidars()) {
    setup_.check();
    body_.stand_in(world);
  }
  AutopilotFlight(const AutopilotFlight&) = delete;
  AutopilotFlight& operator=(const AutopilotFlight&) = delete;

  void step() { (void)flight_.step({runtime_runs_, runtime_runs_, 1.0}); }
  void cut(bool is_cut) { aircraft_.cut(is_cut); }
  void jump(const Vector3& by_W) { aircraft_.fake().move_origin(by_W); }
  /// Killed: nothing of the runtime runs any more.
  void kill_runtime() { runtime_runs_ = false; }
  /// Whoever makes the depth images is gone.
  void kill_cameras() { cameras_are_dead_ = true; }

  [[nodiscard]] const TrajectoryPoint& reference() { return flight_.system().control().reference(); }
  [[nodiscard]] const sitl::VehicleState& truth() const { return body_.vehicle().state(); }
  [[nodiscard]] MonotonicTime now() const { return flight_.now(); }
  [[nodiscard]] double now_s() const { return seconds(flight_.now().time_since_epoch()); }
  [[nodiscard]] bool airborne() { return flight_.system().control().airborne(); }
  [[nodiscard]] firmware_if::AutopilotStage stage() { return aircraft_.companion().report().stage; }
  [[nodiscard]] const flight::FlightConfig& config() const { return flight_config_; }
  [[nodiscard]] flight::FlightSystem& system() { return flight_.system(); }
  [[nodiscard]] sitl::AutopilotAircraft& aircraft() { return aircraft_; }
  [[nodiscard]] double ground_m() const { return body_.vehicle().ground_m(); }

 private:
  class SwitchedCamera final : public firmware_if::DepthCamera {
   public:
    SwitchedCamera(firmware_if::DepthCamera& camera, const bool& is_dead)
        : camera_(camera), is_dead_(is_dead) {}
    [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override {
      return is_dead_ ? Status::kNotReady : camera_.read(frame);
    }
    [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return camera_.mount(); }

   private:
    firmware_if::DepthCamera& camera_;
    const bool& is_dead_;
  };
  template <typename Cameras>
  std::vector<firmware_if::DepthCamera*> switched(const Cameras& cameras) {
    std::vector<firmware_if::DepthCamera*> all;
    for (firmware_if::DepthCamera* const camera : cameras)
      all.push_back(&switches_.emplace_back(*camera, cameras_are_dead_));
    return all;
  }

  static flight::FlightConfig configured(const sitl::World& world, const MissionConfig& config,
                                         bool stops_straight) {
    flight::FlightConfig flight = flight_config_of(world, config);
    flight.stops_straight = stops_straight;
    return flight;
  }

  flight::FlightConfig flight_config_;
  sitl::CameraRig rig_;
  sitl::SimulatedAircraft body_;
  sitl::AutopilotAircraft aircraft_;
  bool runtime_runs_{true}, cameras_are_dead_{false};
  std::deque<SwitchedCamera> switches_;
  std::vector<firmware_if::DepthCamera*> cameras_, watched_;
  FlightSetup setup_;
  flight::LockstepFlight flight_;
};

}  // namespace roborun::mission
