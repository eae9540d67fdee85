/// A flight on ROS 2 topics: state, set-point, planned path and map, from what its live view shows.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "platform/feed/dds/dds_node.hpp"
#include "platform/feed/dds/live_client.hpp"

namespace roborun::feed {

/// One thread. Frames: `world` (ENU) and `body` (FLU). Stamps are the wall clock when a message came here, up to 0.1 s after it held.
///
/// | topic | type | from |
/// | PREFIX/state | nav_msgs/Odometry | /state |
/// | PREFIX/set_point | trajectory_msgs/MultiDOFJointTrajectory, one point | /state |
/// | PREFIX/path | nav_msgs/Path, from the vehicle on | /trajectory |
/// | PREFIX/map | nav_msgs/OccupancyGrid, latched | /map |
class FlightPublisher {
 public:
  /// `live`: port of the flight's live view. Throws InputError.
  FlightPublisher(DdsNode& node, const std::string& prefix, std::uint16_t live);

  void step(std::int64_t now_ns) { client_.step(now_ns); }
  [[nodiscard]] bool is_connected() const noexcept { return client_.is_connected(); }
  /// Never decrease.
  [[nodiscard]] std::uint64_t published() const noexcept { return published_; }
  [[nodiscard]] std::uint64_t not_understood() const noexcept { return not_understood_; }

 private:
  void publish(const std::string& topic, std::string_view json);
  void write(dds_entity_t writer, const void* message);

  dds_entity_t state_, set_point_, path_, map_;
  std::uint64_t published_{0}, not_understood_{0};
  LiveClient client_;
};

}  // namespace roborun::feed
