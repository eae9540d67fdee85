#include "platform/can/command_meter.hpp"

#include "firmware_if/dronecan/transfer.hpp"

namespace roborun::can {
namespace {

namespace dc = firmware_if::dronecan;

bool is_command(const firmware_if::CanFrame& frame) noexcept {
  const dc::TransferHeader header = dc::from_can_id(frame.id);
  return frame.size > 0 && header.kind == dc::TransferKind::kMessage &&
         header.data_type_id == dc::kType<dc::EscRawCommand>.id;
}
/// The last byte of a frame ends in the transfer id.
std::size_t transfer_id(const firmware_if::CanFrame& frame) noexcept {
  return frame.data[frame.size - 1U] & 31U;
}

}  // namespace

void CommandMeter::sent(const firmware_if::CanFrame& frame) noexcept {
  if (!is_command(frame)) return;
  const std::size_t id = transfer_id(frame);
  if (on_its_way_[id] != 0) ++lost_;
  made_[id] = frame.stamp;
  on_its_way_[id] = ++sent_;
}

void CommandMeter::heard(const firmware_if::CanFrame& frame) noexcept {
  if (!is_command(frame)) return;
  const std::size_t id = transfer_id(frame);
  if (on_its_way_[id] == 0) return;
  // A bus keeps the order of one sender's frames: what was sent before this one and is not here never comes.
  for (std::uint64_t& other : on_its_way_) {
    if (other == 0 || other >= on_its_way_[id]) continue;
    ++lost_;
    other = 0;
  }
  on_its_way_[id] = 0;
  const Nanos age = frame.stamp - made_[id];
  age_.add(age);
  if (age > late_after_) ++late_;
  if (heard_++ > 0) gap_.add(frame.stamp - last_heard_);
  last_heard_ = frame.stamp;
}

}  // namespace roborun::can
