#include "platform/sensor_port/port_bus.hpp"

#include <algorithm>

namespace roborun::sensor_port {
namespace {

constexpr std::uint32_t kIdBits = 29;
constexpr std::uint32_t kMostBytes = 8;

bool is_frame(std::uint32_t id, std::uint32_t size) noexcept {
  return id >> kIdBits == 0 && size <= kMostBytes;
}

}  // namespace

std::string PortCan::listen(const std::string& path, const PortClock& clock) {
  allow_equal_stamps();  // one transfer, one instant
  std::string wrong = PortDevice::open(path, ROBORUN_PORT_CAN, clock);
  listens_ = wrong.empty();
  return wrong;
}

std::string PortCan::speak(const std::string& path, const PortClock& clock) {
  epoch_ = clock.epoch;
  return writer_.open(path, ROBORUN_PORT_CAN, 0, kSlots);
}

Status PortCan::send(std::span<const firmware_if::CanFrame> transfer) noexcept {
  if (transfer.empty() || transfer.size() > kMostFrames) return Status::kInvalidArgument;
  for (const firmware_if::CanFrame& frame : transfer)
    if (!is_frame(frame.id, frame.size)) return Status::kInvalidArgument;
  if (!writer_.is_open()) return Status::kIo;
  for (const firmware_if::CanFrame& frame : transfer) {
    roborun_port_can sample{};
    sample.at.stamp_ns = (frame.stamp.time_since_epoch() + epoch_).count();
    sample.at.sequence = ++sent_;
    sample.id = frame.id;
    sample.size = frame.size;
    std::copy_n(frame.data.begin(), frame.size, sample.data);
    (void)writer_.write(sample);
    ++counters_.sent;
  }
  return Status::kOk;
}

Status PortCan::receive(firmware_if::CanFrame& frame) noexcept {
  if (!listens_) return Status::kIo;
  PortSample port;
  const Status status = reader_.next(port);
  counters_.lost_on_receive = reader_.counters().dropped;
  if (status != Status::kOk) return status;
  roborun_port_can sample;
  const auto stamp = take(port, sample);
  if (!stamp) return Status::kNotReady;
  if (!is_frame(sample.id, sample.size)) {
    ++refusals_.values;
    return Status::kNotReady;
  }
  frame = {};
  frame.id = sample.id;
  frame.size = static_cast<std::uint8_t>(sample.size);
  std::copy_n(sample.data, sample.size, frame.data.begin());
  frame.stamp = *stamp;
  ++counters_.received;
  return Status::kOk;
}

firmware_if::CanState PortCan::state() const noexcept {
  return listens_ && writer_.is_open() ? firmware_if::CanState::kActive : firmware_if::CanState::kDetached;
}

std::string PortLines::open(const std::string& path, const PortClock& clock) {
  is_gone_ = true;
  return PortDevice::open(path, ROBORUN_PORT_LINES, clock);
}

void PortLines::update(MonotonicTime now) noexcept {
  PortSample port;
  roborun_port_lines sample;
  if (reader_.newest(port) == Status::kOk && take(port, sample)) {
    wired_ = sample.wired;
    active_ = sample.active;
  }
  is_gone_ = newest() == MonotonicTime::min() || now - newest() > kGoneAfter;
}

Result<bool> PortLines::level(std::uint32_t bit) const noexcept {
  if (is_gone_ || (wired_ & bit) == 0) return Status::kIo;
  return (active_ & bit) != 0;
}

bool PortLines::hears_operator() const noexcept {
  const Result<bool> heard = level(ROBORUN_PORT_OPERATOR);
  return heard.ok() && heard.value();
}

}  // namespace roborun::sensor_port
