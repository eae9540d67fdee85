#include "platform/live/plant_side.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/input/input_error.hpp"
#include "platform/live/plant_bus.hpp"
#include "platform/live/plant_ports.hpp"
#include "platform/sensor_port/port_bus.hpp"
#include "platform/sitl/autopilot/fake_autopilot.hpp"
#include "platform/sitl/bus/fake_hardpoint.hpp"

namespace roborun::live {
namespace {

constexpr std::uint8_t kHookNode = 34;

/// Sensors, bus and lines as another process sees them.
class PortSide final : public PlantSide {
 public:
  PortSide(sitl::SimulatedPlant& plant, const SensorRig& rig, const sensor_port::VehiclePorts& names,
           const sensor_port::EarthPlace& origin, const std::optional<PlantBus>& on_bus, KernelEnds kernel)
      : plant_(plant),
        bus_out_(names.bus_out()),
        navigation_(rig, names, origin, on_bus.has_value()),
        kernel_(std::move(kernel)),
        hook_({.node_id = kHookNode}, plant.far_side().spare_bus(1)) {
    if (on_bus) nodes_.emplace(plant.far_side().spare_bus(), origin, rig.gnss);
    if (kernel_.bus) return;
    const std::string wrong = bus_.speak(names.bus_in(), {});
    if (!wrong.empty()) throw InputError(fmt::format("{}: {}", names.bus_in(), wrong));
  }

  /// The runtime makes the port on which it speaks.
  void listen() override {
    if (kernel_.bus) return;
    if (!listens_ || bus_.reader().is_replaced()) listens_ = bus_.listen(bus_out_, {}).empty();
  }

  bool hear(MonotonicTime clock_now) override {
    constexpr int kMost = 64;
    const std::uint64_t before = commands_;
    firmware_if::CanFrame frame;
    for (int i = 0; i < kMost && wire().receive(frame) == Status::kOk; ++i) {
      ++commands_;
      // The simulated wire knows no frame that is yet to be made, and the world is up to a minor frame behind.
      frame.stamp = std::min(MonotonicTime{frame.stamp.time_since_epoch() - shift_}, plant_.now());
      (void)plant_.far_side().bus().send({&frame, 1});
    }
    plant_.far_side().break_lines(plant_.now());
    if (nodes_) operator_.step(clock_now, commands_ != before);
    return commands_ != before;
  }

  void tell(MonotonicTime clock_now, Nanos shift) override {
    shift_ = shift;
    sitl::FaultySensors& sensors = plant_.sensors();
    if (nodes_) nodes_->step(plant_.now(), clock_now - plant_.now(), plant_.vehicle());
    hook_.step(plant_.now());
    if (!package_ && !hook_.holds_package())
      package_ = {plant_.vehicle().state().p_WB.z() - plant_.vehicle().ground_m(),
                  plant_.vehicle().state().v_WB.norm()};
    const auto pass = [&](auto sample) {
      while (sensors.read(sample) == Status::kOk) {
        if constexpr (requires { nodes_->say(sample); }) {
          if (nodes_) {
            nodes_->say(sample);
            continue;
          }
        }
        navigation_.write(sample, shift);
      }
    };
    pass(firmware_if::ImuSample{});
    pass(firmware_if::GnssFix{});
    pass(firmware_if::BarometerSample{});
    if (plant_.has_odometry()) pass(firmware_if::OdometrySample{});
    firmware_if::CanFrame frame;
    while (plant_.far_side().bus().receive(frame) == Status::kOk) {
      frame.stamp += shift;
      (void)wire().send({&frame, 1});
    }
    std::uint32_t active = plant_.hears_operator() ? ROBORUN_PORT_OPERATOR : 0;
    std::uint32_t gone = 0;
    const auto look = [&](firmware_if::GpioInput& line, std::uint32_t bit) {
      const Result<bool> level = line.active();
      if (!level.ok()) gone |= bit;
      if (level.ok() && level.value()) active |= bit;
    };
    look(plant_.far_side().kill_open(), ROBORUN_PORT_KILL_OPEN);
    look(plant_.far_side().kill_closed(), ROBORUN_PORT_KILL_CLOSED);
    if (operator_.presses_kill())
      active = (active | ROBORUN_PORT_KILL_OPEN) & ~std::uint32_t{ROBORUN_PORT_KILL_CLOSED};
    if (operator_.arms()) active |= ROBORUN_PORT_ARM;
    const auto pull = [&](const std::unique_ptr<SimLine>& line, std::uint32_t bit) {
      if (line && !line->pull((active & bit) != 0)) ++pulls_refused_;
    };
    pull(kernel_.kill_open, ROBORUN_PORT_KILL_OPEN);
    pull(kernel_.kill_closed, ROBORUN_PORT_KILL_CLOSED);
    navigation_.write_lines(plant_.now(), active, gone, shift);
  }
  void left_ground(MonotonicTime clock_now) override {
    (void)clock_now;
    operator_.flies();
  }

  [[nodiscard]] std::uint64_t commands() const override { return commands_; }
  [[nodiscard]] std::optional<PlantPackage> package() const override { return package_; }
  [[nodiscard]] std::uint64_t lost() const override {
    if (kernel_.bus)
      return kernel_.bus->counters().lost_on_receive + kernel_.bus->counters().refused + pulls_refused_;
    return bus_.reader().counters().dropped + pulls_refused_;
  }

 private:
  [[nodiscard]] firmware_if::CanBus& wire() noexcept {
    if (kernel_.bus) return *kernel_.bus;
    return bus_;
  }

  sitl::SimulatedPlant& plant_;
  std::string bus_out_;
  NavigationPorts navigation_;
  sensor_port::PortCan bus_;
  KernelEnds kernel_;                 ///< Its bus, if there is one, is instead of bus_.
  std::optional<SensorNodes> nodes_;  ///< None: the sensors are ports.
  PlantOperator operator_;
  sitl::FakeHardpoint hook_;
  std::optional<PlantPackage> package_;
  std::uint64_t pulls_refused_{0};
  Nanos shift_{0};
  bool listens_{false};
  std::uint64_t commands_{0};
};

const char* name_of(sitl::FakeAutopilot::Mode mode) {
  constexpr std::array<const char*, 5> kNames{"manual", "guided", "hold", "return", "land"};
  return kNames.at(static_cast<std::size_t>(mode));
}

/// Its clock goes on while the world stands still, as that of any other computer.
class AutopilotSide final : public PlantSide {
 public:
  AutopilotSide(sitl::SimulatedAircraft& body, const VehicleModel& vehicle, Nanos minor_frame,
                const PlantAutopilot& config, const sensor_port::EarthPlace& origin)
      : body_(body),
        signed_(config.key ? std::make_unique<mavlink::SignedEnd>(*config.key, kLinkId) : nullptr),
        fake_(config.kind, vehicle, minor_frame, signed_ ? signed_->signer() : nullptr,
              signed_ ? signed_->verifier() : nullptr),
        link_(config.link),
        pilot_s_(config.pilot_s) {
    const auto whole = [](double value, double scale) { return static_cast<std::int32_t>(value * scale); };
    fake_.origin.latitude = whole(origin.latitude_deg, 1e7);
    fake_.origin.longitude = whole(origin.longitude_deg, 1e7);
    fake_.origin.altitude = whole(origin.height_m, 1e3);
  }

  bool hear(MonotonicTime clock_now) override {
    constexpr int kMost = 64;
    bool heard = false;
    if (signed_) signed_->tick(clock_now);
    for (int i = 0; i < kMost; ++i) {
      const std::size_t count = link_.read(clock_now, bytes_);
      if (count == 0) break;
      heard = true;
      fake_.receive(clock_now, std::span<const std::uint8_t>(bytes_).first(count));
    }
    return heard;
  }

  void tell(MonotonicTime clock_now, Nanos shift) override {
    (void)shift;
    if (pilot_s_ && left_ground_ && seconds(clock_now - *left_ground_) > *pilot_s_) {
      fake_.pilot_takes(sitl::FakeAutopilot::Mode::kLand);
      pilot_s_.reset();
    }
    const MonotonicTime now = body_.plant().now();
    fake_.step(clock_now, body_, body_.vehicle().state().on_ground, body_.health(now).battery_ratio);
    body_.end_frame(now);
    (void)link_.write(clock_now, fake_.outgoing());
    fake_.sent_all();
  }

  void left_ground(MonotonicTime clock_now) override {
    if (!left_ground_) left_ground_ = clock_now;
  }
  [[nodiscard]] std::uint64_t commands() const override {
    const sitl::FakeAutopilot::Counters& c = fake_.counters();
    return c.set_points + c.refused_set_points + c.ignored_set_points;
  }
  [[nodiscard]] std::uint64_t lost() const override { return fake_.counters().not_sent; }
  [[nodiscard]] std::optional<PlantAutopilotReport> autopilot() const override {
    const sitl::FakeAutopilot::Counters& c = fake_.counters();
    return PlantAutopilotReport{name_of(fake_.mode()), fake_.armed(),   c.set_points,
                                c.refused_set_points,  c.timeouts,      c.releases,
                                c.lost_frames,         c.doubled_frames};
  }

 private:
  sitl::SimulatedAircraft& body_;
  static constexpr std::uint8_t kLinkId = 1;  ///< The number of its port, as ArduPilot has it.
  std::unique_ptr<mavlink::SignedEnd> signed_;
  sitl::FakeAutopilot fake_;
  mavlink::Link link_;
  std::array<std::uint8_t, 4096> bytes_{};
  std::optional<double> pilot_s_;
  std::optional<MonotonicTime> left_ground_;
};

}  // namespace

KernelEnds kernel_ends(const std::optional<PlantBus>& on_bus) {
  KernelEnds ends;
  if (!on_bus) return ends;
  if (!on_bus->interface.empty()) {
    ends.bus = std::make_unique<can::SocketCan>();
    if (const std::string wrong = ends.bus->open(on_bus->interface); !wrong.empty())
      throw InputError("--can: " + wrong);
  }
  if (!on_bus->kill_pulls.empty()) {
    ends.kill_open = std::make_unique<SimLine>("--kill-pulls", on_bus->kill_pulls.at(0));
    ends.kill_closed = std::make_unique<SimLine>("--kill-pulls", on_bus->kill_pulls.at(1));
  }
  return ends;
}

std::unique_ptr<PlantSide> port_side(sitl::SimulatedAircraft& body, const SensorRig& rig,
                                     const sensor_port::VehiclePorts& names,
                                     const sensor_port::EarthPlace& origin,
                                     const std::optional<PlantBus>& on_bus, KernelEnds kernel) {
  return std::make_unique<PortSide>(body.plant(), rig, names, origin, on_bus, std::move(kernel));
}

std::unique_ptr<PlantSide> autopilot_side(sitl::SimulatedAircraft& body, const VehicleModel& vehicle,
                                          Nanos minor_frame, const PlantAutopilot& config,
                                          const sensor_port::EarthPlace& origin) {
  return std::make_unique<AutopilotSide>(body, vehicle, minor_frame, config, origin);
}

}  // namespace roborun::live
