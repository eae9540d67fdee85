/// Frames that tests of transfers change.
#pragma once

#include "firmware_if/can.hpp"

namespace roborun::test {

using firmware_if::CanFrame;

/// The same with another last byte: start, end, toggle, transfer id.
inline CanFrame with_tail(CanFrame frame, unsigned tail) {
  frame.data.at(frame.size - 1U) = static_cast<std::uint8_t>(tail);
  return frame;
}

/// A transfer of two bytes in one frame.
inline CanFrame single_frame(std::uint32_t id) {
  CanFrame frame;
  frame.id = id;
  frame.size = 3;
  frame.data = {7, 8, 0xc5};
  return frame;
}

}  // namespace roborun::test
