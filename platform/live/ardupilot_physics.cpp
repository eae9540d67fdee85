#include "platform/live/ardupilot_physics.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cstring>

#include "core/geometry/math.hpp"
#include "firmware_if/mavlink/ned.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

namespace mav = firmware_if::mavlink;

constexpr std::size_t kHeader_bytes = 8;

unsigned word(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return bytes[at] | static_cast<unsigned>(bytes[at + 1]) << 8U;
}

double thrust_ratio(unsigned pwm_us) noexcept {
  const double u = std::clamp((static_cast<double>(pwm_us) - 1000.0) / 1000.0, 0.0, 1.0);
  return 0.35 * u + 0.65 * u * u;
}

std::array<double, 3> numbers(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }

}  // namespace

std::optional<ServoPacket> servo_packet(std::span<const std::uint8_t> bytes) noexcept {
  constexpr unsigned kFew = 18458, kMany = 29569, kSlowest_Hz = 50;
  const bool few = bytes.size() == kHeader_bytes + 32 && word(bytes, 0) == kFew;
  const bool many = bytes.size() == kHeader_bytes + 64 && word(bytes, 0) == kMany;
  if (!few && !many) return std::nullopt;
  const unsigned rate_Hz = word(bytes, 2);
  if (rate_Hz < kSlowest_Hz) return std::nullopt;
  const auto motor = [&](std::size_t number) {
    return thrust_ratio(word(bytes, kHeader_bytes + 2 * (number - 1)));
  };
  return ServoPacket{word(bytes, 4) | word(bytes, 6) << 16U,
                     {from_seconds(1.0 / rate_Hz), {{motor(3), motor(1), motor(2), motor(4)}}}};
}

std::string state_line(double time_s, const sitl::VehicleState& s) {
  const Vector3 force_W = s.a_WB + Vector3(0.0, 0.0, core::kGravity_mps2);
  const auto gyro = mav::swap_body(numbers(s.w_WB_B));
  const auto force = mav::swap_body(numbers(s.q_WB.conjugate() * force_W));
  const auto p = mav::swap_world(numbers(s.p_WB)), v = mav::swap_world(numbers(s.v_WB));
  const auto q = mav::swap_attitude({s.q_WB.w(), s.q_WB.x(), s.q_WB.y(), s.q_WB.z()});
  const auto list = [](const auto& x) { return fmt::format("[{:.9g}]", fmt::join(x, ",")); };
  return fmt::format(
      "\n{{\"timestamp\":{:.9f},\"imu\":{{\"gyro\":{},\"accel_body\":{}}},\"position\":{},\"velocity\":{},"
      "\"quaternion\":{}}}\n",
      time_s, list(gyro), list(force), list(p), list(v), list(q));
}

ArduPilotPhysics::ArduPilotPhysics(int port)
    : link_({mavlink::LinkAddress::Kind::kUdpIn, "127.0.0.1", port}) {
  (void)link_.read(clock_.now(), bytes_);
  if (!link_.is_open())
    throw InputError(fmt::format("--physics-port: UDP {}: {}", port, std::strerror(link_.why())));
}

void ArduPilotPhysics::send() {
  std::array<std::uint8_t, 1024> bytes{};
  const std::size_t count = std::min(answer_.size(), bytes.size());
  std::copy_n(answer_.begin(), count, bytes.begin());
  (void)link_.write(clock_.now(), std::span<const std::uint8_t>(bytes).first(count));
}

std::optional<PhysicsStep> ArduPilotPhysics::take(std::span<const std::uint8_t> bytes) {
  const auto packet = servo_packet(bytes);
  if (!packet) {
    ++counters_.refused;
    return std::nullopt;
  }
  if (frame_ && packet->frame == *frame_) {
    ++counters_.resent;
    send();
    return std::nullopt;
  }
  if (frame_ && packet->frame < *frame_) {
    ++counters_.restarts;
    time_ = Nanos{0};
  } else if (frame_) {
    counters_.lost += packet->frame - *frame_ - 1;
  }
  time_ += packet->step.dt;
  frame_ = packet->frame;
  ++counters_.steps;
  return packet->step;
}

std::optional<PhysicsStep> ArduPilotPhysics::wait() {
  const MonotonicTime until = clock_.now() + kPatience;
  for (MonotonicTime now = clock_.now(); now < until; now = clock_.now()) {
    if (const std::size_t count = link_.read(now, bytes_); count > 0) {
      if (const auto step = take(std::span<const std::uint8_t>(bytes_).first(count))) return step;
      continue;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - now);
    pollfd waiting{link_.fd(), POLLIN, 0};
    (void)::poll(&waiting, 1, static_cast<int>(left.count()));
  }
  return std::nullopt;
}

void ArduPilotPhysics::answer(sitl::SimulatedPlant& plant) {
  answer_ = state_line(seconds(time_), plant.vehicle().state());
  send();
}

}  // namespace roborun::live
