/// Sensor ports. First byte even: the rest are the bytes of the file. Odd: a good port of the kind of the second byte, to which samples and
/// single wrong bytes are written while the device reads. Oracle: what a device hands out is finite and as its contract says.
#include <fcntl.h>

#include <array>
#include <cmath>

#include "platform/sensor_port/port_bus.hpp"
#include "platform/sensor_port/port_navigation.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace roborun::fuzz {
namespace {

using namespace sensor_port;

void check(const firmware_if::DepthFrame& frame) {
  require(frame.width >= 8 && frame.height >= 8, "an image has pixels");
  require(frame.depth_m.size() == std::size_t{frame.width} * frame.height, "an image has all its pixels");
  require(frame.tan_half_width > 0.0F && frame.tan_half_height > 0.0F && frame.range_m > 0.0F,
          "optics are positive");
  for (const float depth_m : frame.depth_m) require(!(depth_m < 0.0F), "depth is not negative");
}
void check(const firmware_if::LidarSweep& sweep) { require(sweep.range_m > 0.0F, "the range is positive"); }
void check(const firmware_if::ImuSample& sample) {
  for (const double x : sample.angular_rate_B_radps) require(std::isfinite(x), "rates are finite");
  for (const double x : sample.specific_force_B_mps2) require(std::isfinite(x), "forces are finite");
}
void check(const firmware_if::OdometrySample& sample) {
  double length2 = 0.0;
  for (const double x : sample.q_OB) length2 += x * x;
  require(std::fabs(std::sqrt(length2) - 1.0) < 0.011, "a turn is a turn");
  for (const double x : sample.p_OB_m) require(std::isfinite(x), "positions are finite");
}
void check(const firmware_if::GnssFix& fix) {
  for (const double x : fix.p_WB_m) require(std::isfinite(x), "fixes are finite");
  for (const double x : fix.v_WB_mps) require(std::isfinite(x), "speeds are finite");
}
void check(const firmware_if::BarometerSample& sample) {
  require(std::isfinite(sample.altitude_m), "heights are finite");
}
void check(const firmware_if::CanFrame& frame) { require(frame.size <= 8, "a frame has at most 8 bytes"); }

/// The file of a port as its writer keeps it; the layout stays what it is, whatever was written over the header.
class Port {
 public:
  Port(std::uint32_t kind, Choices& choices)
      : sample_bytes_(roborun_port_sample_bytes(kind)), choices_(choices) {
    roborun_port_header header{};
    std::memcpy(header.magic, ROBORUN_PORT_MAGIC, sizeof header.magic);
    header.version = ROBORUN_PORT_VERSION;
    header.kind = kind;
    header.slot_count = kSlots;
    header.slot_bytes = kSlot_bytes;
    header.sample_bytes = sample_bytes_;
    header.writer = 1;
    std::string bytes(roborun_port_file_bytes(kSlots, kSlot_bytes), '\0');
    std::memcpy(bytes.data(), &header, sizeof header);
    path_ = file("port", {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
    fd_ = open(path_.c_str(), O_RDWR | O_CLOEXEC);
  }
  ~Port() { (void)close(fd_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// One more sample, a wrong byte, or both.
  void go_on() {
    const std::uint8_t deed = choices_.byte();
    if (deed % 4U != 0) write_sample(deed);
    if (deed % 8U != 0) return;
    const std::uint8_t wrong = choices_.byte();
    put(&wrong, 1, choices_.number<std::uint16_t>() % roborun_port_file_bytes(kSlots, kSlot_bytes));
  }

 private:
  static constexpr std::uint32_t kSlots = 2;
  static constexpr std::uint32_t kSlot_bytes = 2048;

  void write_sample(std::uint8_t deed) {
    const std::uint64_t at = sizeof(roborun_port_header) + (written_ % kSlots) * kSlot_bytes;
    std::array<std::uint8_t, kSlot_bytes> slot{};
    roborun_port_slot head{2 * written_ + 2, 0, 0};
    auto sample = choices_.take(sample_bytes_);
    // What a fuzzer can hardly guess: a sample after the one before, and as many bytes as an image of small size has.
    roborun_port_stamp stamp{};
    std::memcpy(&stamp, sample.data(), std::min(sample.size(), sizeof stamp));
    if (deed % 4U != 3) stamp.stamp_ns = static_cast<std::int64_t>(2000 + 1000 * written_);
    head.payload_bytes = choices_.number<std::uint16_t>();
    const std::size_t room = slot.size() - sizeof head - sample_bytes_;
    const auto payload = choices_.take(std::min<std::size_t>(head.payload_bytes, room));
    std::memcpy(slot.data(), &head, sizeof head);
    std::ranges::copy(sample, slot.begin() + sizeof head);
    std::memcpy(slot.data() + sizeof head, &stamp, sizeof stamp);
    std::ranges::copy(payload, slot.begin() + sizeof head + sample_bytes_);
    put(slot.data(), slot.size(), at);
    ++written_;
    put(&written_, sizeof written_, offsetof(roborun_port_header, written));
  }
  void put(const void* from, std::size_t bytes, std::uint64_t at) const {
    require(pwrite(fd_, from, bytes, static_cast<off_t>(at)) == static_cast<ssize_t>(bytes),
            "the disk has room");
  }

  std::uint32_t sample_bytes_;
  Choices& choices_;
  std::string path_;
  int fd_{-1};
  std::uint64_t written_{0};
};

template <typename Device, typename Sample>
void read(Device& device, const std::string& wrong, Port* port, Choices& choices) {
  if (!wrong.empty()) return;
  const auto get = [&](Sample& sample) {
    if constexpr (std::is_same_v<Device, PortCan>) {
      return device.receive(sample);
    } else {
      return device.read(sample);
    }
  };
  do {
    if (port != nullptr) port->go_on();
    Sample sample{};
    for (int i = 0; i < 3 && get(sample) == Status::kOk; ++i) check(sample);
  } while (port != nullptr && !choices.empty());
}

void read_kind(std::uint32_t kind, const std::string& path, Port* port, Choices& choices) {
  const PortClock clock{Nanos{1000}};
  const auto with = [&]<typename Device, typename Sample>(Device&& device, Sample /*what*/) {
    read<Device, Sample>(device, device.open(path, clock), port, choices);
  };
  switch (kind) {
    case ROBORUN_PORT_DEPTH:
      return with(PortDepthCamera{}, firmware_if::DepthFrame{});
    case ROBORUN_PORT_CLOUD:
      return with(PortLidar{}, firmware_if::LidarSweep{});
    case ROBORUN_PORT_ODOMETRY:
      return with(PortOdometry{}, firmware_if::OdometrySample{});
    case ROBORUN_PORT_IMU:
      return with(PortImu{}, firmware_if::ImuSample{});
    case ROBORUN_PORT_GNSS:
      return with(PortGnss{}, firmware_if::GnssFix{});
    case ROBORUN_PORT_PRESSURE:
      return with(PortBarometer{}, firmware_if::BarometerSample{});
    case ROBORUN_PORT_CAN: {
      PortCan can;
      const std::string wrong = can.listen(path, clock);
      return read<PortCan, firmware_if::CanFrame>(can, wrong, port, choices);
    }
    default: {
      PortLines lines;
      if (!lines.open(path, clock).empty()) return;
      for (int i = 0; i < 8; ++i) {
        if (port != nullptr) port->go_on();
        lines.update(MonotonicTime{Nanos{1'000'000 * i}});
      }
    }
  }
}

}  // namespace
}  // namespace roborun::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun::fuzz;
  Choices choices(data, size);
  const bool is_good = choices.byte() % 2U == 1;
  const std::uint32_t kind = choices.byte() % 9U + 1U;
  if (is_good) {
    Port port(kind, choices);
    read_kind(kind, port.path(), &port, choices);
  } else {
    const auto bytes = choices.rest();
    read_kind(kind, file("port", bytes), nullptr, choices);
  }
  return 0;
}
