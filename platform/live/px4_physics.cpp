#include "platform/live/px4_physics.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/geometry/math.hpp"
#include "firmware_if/mavlink/ned.hpp"
#include "platform/input/input_error.hpp"
#include "platform/live/earth_field.hpp"

namespace roborun::live {
namespace {

namespace mav = firmware_if::mavlink;

constexpr Nanos kSilent{1'000'000'000};  // then one more step is made
constexpr Nanos kBehind{100'000'000};    // more is not made up for

/// Readable before `at`.
void wait_for(int fd, Nanos most) {
  const std::int64_t ns = std::max<std::int64_t>(most.count(), 0);
  const timespec time{static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
  pollfd waiting{fd, POLLIN, 0};
  (void)::ppoll(&waiting, 1, &time, nullptr);
}

std::array<double, 3> numbers(const Vector3& v) noexcept { return {v.x(), v.y(), v.z()}; }

template <typename T>
T rounded(double value) noexcept {
  constexpr double kLeast = std::numeric_limits<T>::min(), kMost = std::numeric_limits<T>::max();
  return static_cast<T>(std::clamp(std::round(value), kLeast, kMost));
}

}  // namespace

firmware_if::MotorCommand motors_of(const mav::HilActuatorControls& m) noexcept {
  constexpr unsigned kArmed = 128;
  if ((m.mode & kArmed) == 0) return {};
  const auto motor = [&m](std::size_t number) {
    const auto control = static_cast<double>(m.controls.at(number - 1));
    return std::isfinite(control) ? std::clamp(control, 0.0, 1.0) : 0.0;
  };
  return {{motor(3), motor(1), motor(2), motor(4)}};
}

Px4Physics::Px4Physics(int port, const sensor_port::EarthPlace& origin)
    : origin_(origin),
      frame_(origin),
      field_W_gauss_(earth_field_gauss(origin.latitude_deg, origin.longitude_deg)),
      server_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  (void)setsockopt(server_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool listens = ::bind(server_, reinterpret_cast<sockaddr*>(&address), sizeof address) ==
                           0 &&  // NOLINT(*-reinterpret-cast)
                       ::listen(server_, 1) == 0;
  if (listens) return;
  const std::string why = std::strerror(errno);
  if (server_ >= 0) (void)::close(server_);
  throw InputError(fmt::format("--physics-port: TCP {}: {}", port, why));
}

Px4Physics::~Px4Physics() {
  hang_up();
  (void)::close(server_);
}

void Px4Physics::hang_up() {
  if (client_ >= 0) (void)::close(client_);
  client_ = -1;
  motors_ = {};
}

bool Px4Physics::greet() {
  if (client_ >= 0) return true;
  wait_for(server_, kPatience);
  client_ = ::accept4(server_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (client_ < 0) return false;
  const int on = 1;
  (void)setsockopt(client_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (std::exchange(had_client_, true)) ++counters_.restarts;
  receiver_ = mav::Receiver();
  is_booting_ = true;
  due_ = clock_.now();
  return true;
}

void Px4Physics::take(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    bytes = bytes.subspan(receiver_.push(bytes));
    mav::Frame frame;
    for (mav::Event event = receiver_.next(frame); event != mav::Event::kNothing;
         event = receiver_.next(frame)) {
      if (event == mav::Event::kBadCrc || event == mav::Event::kBadFlags) ++counters_.refused;
      if (event != mav::Event::kFrame || frame.msgid != mav::kHilActuatorControls.id) continue;
      motors_ = motors_of(mav::unpack<mav::HilActuatorControls>(frame.payload));
      is_answered_ = true;
      is_booting_ = false;
    }
  }
}

void Px4Physics::hear() {
  constexpr int kMost = 16;
  std::array<std::uint8_t, 2048> bytes{};
  for (int i = 0; client_ >= 0 && i < kMost; ++i) {
    const ssize_t count = ::recv(client_, bytes.data(), bytes.size(), 0);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) return hang_up();
    take(std::span<const std::uint8_t>(bytes).first(static_cast<std::size_t>(count)));
  }
}

PhysicsStep Px4Physics::step(MonotonicTime now) {
  if (!is_answered_ && !is_booting_) ++counters_.resent;
  due_ = std::max(due_ + kPeriod, now - kBehind);
  is_answered_ = false;
  ++counters_.steps;
  return {kPeriod, motors_};
}

std::optional<PhysicsStep> Px4Physics::wait() {
  const MonotonicTime until = clock_.now() + kPatience;
  if (!greet()) return std::nullopt;
  for (MonotonicTime now = clock_.now(); now < until; now = clock_.now()) {
    hear();
    if (client_ < 0) return std::nullopt;
    const bool may = is_answered_ || is_booting_ || now - sent_at_ > kSilent;
    if (may && now >= due_) return step(now);
    wait_for(client_, (may ? std::min(due_, until) : until) - now);
  }
  return std::nullopt;
}

template <typename T>
void Px4Physics::send(const T& message) {
  if (client_ < 0) return;
  constexpr std::uint8_t kSystem = 1, kComponent = 191;
  std::array<std::uint8_t, mav::kMostFrame_bytes> frame{};
  const auto length =
      mav::write_frame(T::kType, {seq_++, kSystem, kComponent}, mav::pack(message), nullptr, frame);
  // Half a frame would be the end of the stream's order, and one that does not read is no lock-step.
  const ssize_t left = ::send(client_, frame.data(), length.value(), MSG_NOSIGNAL);
  if (left != static_cast<ssize_t>(length.value())) hang_up();
}

mav::HilSensor Px4Physics::feel(sitl::SimulatedPlant& plant) {
  constexpr double kCompass_gauss = 0.003;  // one sigma
  constexpr double kPa_hPa = 0.01;
  constexpr float kAir_C = 20.0F;
  mav::HilSensor m;
  m.time_usec = static_cast<std::uint64_t>(plant.now().time_since_epoch().count() / 1000);
  const auto put = [](const std::array<double, 3>& v_FLU, float& x, float& y, float& z) {
    const auto v = mav::swap_body(v_FLU);
    x = static_cast<float>(v[0]);
    y = static_cast<float>(v[1]);
    z = static_cast<float>(v[2]);
  };
  firmware_if::ImuSample imu;
  while (plant.sensors().read(imu) == Status::kOk) {
    put(imu.specific_force_B_mps2, m.xacc, m.yacc, m.zacc);
    put(imu.angular_rate_B_radps, m.xgyro, m.ygyro, m.zgyro);
    m.fields_updated |= 0x3fU;
  }
  Vector3 field_B = plant.vehicle().state().q_WB.conjugate() * field_W_gauss_;
  for (int i = 0; i < 3; ++i) field_B[i] += kCompass_gauss * rng_.normal();
  put(numbers(field_B), m.xmag, m.ymag, m.zmag);
  m.fields_updated |= 0x1c0U;
  firmware_if::BarometerSample air;
  while (plant.sensors().read(air) == Status::kOk) {
    const double height_m = origin_.height_m + air.altitude_m;
    m.abs_pressure = static_cast<float>(kPa_hPa * sensor_port::pressure_at(height_m));
    m.pressure_alt = static_cast<float>(height_m);
    m.temperature = kAir_C;
    m.fields_updated |= 0x1a00U;
  }
  return m;
}

mav::HilGps Px4Physics::fix_of(const firmware_if::GnssFix& fix) const {
  constexpr double kTurn_cdeg = 36000.0, kCm = 100.0;
  const sensor_port::EarthPlace place = frame_.to_earth(fix.p_WB_m);
  const auto v = mav::swap_world(fix.v_WB_mps);
  const double course_cdeg = kCm * core::atan2(v[1], v[0]) / core::kDegree;
  mav::HilGps m;
  m.time_usec = static_cast<std::uint64_t>(fix.stamp.time_since_epoch().count() / 1000);
  m.fix_type = 3;
  m.lat = rounded<std::int32_t>(1e7 * place.latitude_deg);
  m.lon = rounded<std::int32_t>(1e7 * place.longitude_deg);
  m.alt = rounded<std::int32_t>(1e3 * place.height_m);
  m.eph = rounded<std::uint16_t>(kCm * fix.sigma_horizontal_m);
  m.epv = rounded<std::uint16_t>(kCm * fix.sigma_vertical_m);
  m.vel = rounded<std::uint16_t>(kCm * core::hypot2(v[0], v[1]));
  m.vn = rounded<std::int16_t>(kCm * v[0]);
  m.ve = rounded<std::int16_t>(kCm * v[1]);
  m.vd = rounded<std::int16_t>(kCm * v[2]);
  m.cog = rounded<std::uint16_t>(course_cdeg < 0.0 ? course_cdeg + kTurn_cdeg : course_cdeg);
  m.satellites_visible = 12;
  return m;
}

void Px4Physics::answer(sitl::SimulatedPlant& plant) {
  firmware_if::GnssFix fix;
  while (plant.sensors().read(fix) == Status::kOk) send(fix_of(fix));
  send(feel(plant));
  sent_at_ = clock_.now();
}

}  // namespace roborun::live
