// A fake autopilot on the simulated vehicle, spoken to with single MAVLink messages.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/vector.hpp"
#include "firmware_if/mavlink/ned.hpp"
#include "platform/sitl/autopilot/autopilot_aircraft.hpp"

namespace roborun::test {

namespace mav = firmware_if::mavlink;

class NoCameras final : public sitl::ExposureSink {
 public:
  void expose(MonotonicTime /*now*/, const Pose& /*X_WB*/) noexcept override {}
};

inline sitl::SimulatorConfig still_air() {
  sitl::SimulatorConfig config;
  config.wind = {Vector3::Zero(), 0.0, 3.0};
  return config;
}

/// Without a companion: what is sent is what the test sends.
class AutopilotBench {
 public:
  static constexpr Nanos kFrame{2'500'000};

  explicit AutopilotBench(mav::AutopilotKind kind, const VehicleModel& vehicle = {}, std::uint64_t seed = 1)
      : body_(vehicle, still_air(), Vector3(0.0, 0.0, 0.05), seed, kFrame, cameras_),
        fake_(kind, vehicle, kFrame) {}

  template <typename T>
  void send(const T& message) {
    std::array<std::uint8_t, mav::kMostFrame_bytes> bytes{};
    const auto length = mav::write_frame(T::kType, {seq_++, 1, 191}, mav::pack(message), nullptr, bytes);
    fake_.receive(now_, std::span<const std::uint8_t>(bytes).first(length.value()));
  }
  void command(std::uint16_t number, float p1, float p2 = 0.0F, float p7 = 0.0F) {
    mav::CommandLong c;
    c.target_system = c.target_component = 1;
    c.command = number;
    c.param1 = p1, c.param2 = p2, c.param7 = p7;
    send(c);
  }
  /// World frame (ENU).
  void set_point(std::uint16_t mask, const Vector3& p_W, const Vector3& v_W, double yaw_rad = 0.0,
                 const Vector3& a_W = Vector3::Zero(), double yaw_rate_radps = 0.0) {
    mav::SetPositionTargetLocalNed m;
    const auto f = [](double x) { return static_cast<float>(x); };
    m.target_system = m.target_component = 1;
    m.coordinate_frame = frame;
    m.type_mask = mask;
    m.x = f(p_W.y()), m.y = f(p_W.x()), m.z = f(-p_W.z());
    m.vx = f(v_W.y()), m.vy = f(v_W.x()), m.vz = f(-v_W.z());
    m.afx = f(a_W.y()), m.afy = f(a_W.x()), m.afz = f(-a_W.z());
    m.yaw = f(mav::swap_yaw(yaw_rad));
    m.yaw_rate = f(-yaw_rate_radps);
    send(m);
  }
  void step() {
    now_ += kFrame;
    body_.begin_frame(now_);
    const sitl::VehicleState& truth = body_.vehicle().state();
    fake_.step(now_, body_, truth.on_ground, truth.battery_ratio);
    body_.end_frame(now_);
    read();
  }
  /// So long, with `each` every 50 ms (20 Hz).
  template <typename Each>
  void run(double time_s, Each&& each) {
    for (int i = 0; i < static_cast<int>(time_s * 400.0); ++i) {
      if (i % 20 == 0) each();
      step();
    }
  }
  void run(double time_s) {
    run(time_s, [] {});
  }
  /// ArduCopter, hovering at 10 m.
  void take_off() {
    run(3.5);
    command(176, 1.0F, 4.0F);
    command(400, 1.0F);
    command(22, 0.0F, 0.0F, 10.0F);
    run(12.0);
  }

  [[nodiscard]] sitl::FakeAutopilot& fake() { return fake_; }
  [[nodiscard]] const sitl::VehicleState& truth() const { return body_.vehicle().state(); }
  [[nodiscard]] double now_s() const { return seconds(now_.time_since_epoch()); }
  [[nodiscard]] MonotonicTime now() const { return now_; }
  /// Result of the last COMMAND_ACK; 255: none.
  [[nodiscard]] int ack() const { return ack_; }
  std::uint8_t frame{1};  ///< MAV_FRAME of set-points.

 private:
  void read() {
    auto bytes = fake_.outgoing();
    while (!bytes.empty()) {
      bytes = bytes.subspan(receiver_.push(bytes));
      mav::Frame frame_in;
      for (mav::Event event = receiver_.next(frame_in); event != mav::Event::kNothing;
           event = receiver_.next(frame_in)) {
        if (event == mav::Event::kFrame && frame_in.msgid == mav::kCommandAck.id)
          ack_ = mav::unpack<mav::CommandAck>(frame_in.payload).result;
      }
    }
    fake_.sent_all();
  }

  NoCameras cameras_;
  sitl::SimulatedAircraft body_;
  sitl::FakeAutopilot fake_;
  mav::Receiver receiver_;
  MonotonicTime now_{};
  std::uint8_t seq_{0};
  int ack_{255};
};

}  // namespace roborun::test
