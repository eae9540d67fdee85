#include "platform/feed/dds/flight_publisher.hpp"

#include <fmt/format.h>
#include <ros2_messages.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "core/geometry/vector.hpp"
#include "platform/feed/dds/ros_clock.hpp"
#include "platform/input/base64.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"

namespace roborun::feed {
namespace {

using Json = nlohmann::json;

std::string world = "world", body = "body";  // messages hold no constants

/// What is not finite is null in a log.
double number(const Json& json, const char* key) {
  const Json& value = json.at(key);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

std_msgs_msg_dds__Header_ header_now() {
  const std::int64_t wall_ns = clocks_now().wall.count();
  return {{static_cast<std::int32_t>(wall_ns / 1'000'000'000),
           static_cast<std::uint32_t>(wall_ns % 1'000'000'000)},
          world.data()};
}

Vector3 vector_of(const Json& json, const char* x, const char* y, const char* z) {
  return {number(json, x), number(json, y), number(json, z)};
}
geometry_msgs_msg_dds__Vector3_ ros_of(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
geometry_msgs_msg_dds__Twist_ twist_of(const Vector3& v) { return {ros_of(v), {0.0, 0.0, 0.0}}; }

nav_msgs_msg_dds__Odometry_ odometry_of(const Json& state) {
  nav_msgs_msg_dds__Odometry_ out{};
  out.header = header_now();
  out.child_frame_id = body.data();
  const Vector3 p = vector_of(state, "x_m", "y_m", "z_m");
  const Quaternion q(number(state, "qw"), number(state, "qx"), number(state, "qy"), number(state, "qz"));
  out.pose.pose = {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
  const double sigma_m = number(state, "position_sigma_m");
  for (std::size_t i = 0; i < 3; ++i) out.pose.covariance[7 * i] = sigma_m * sigma_m;
  out.twist.twist = {ros_of(q.conjugate() * vector_of(state, "vx_mps", "vy_mps", "vz_mps")),
                     ros_of(vector_of(state, "wx_radps", "wy_radps", "wz_radps"))};
  return out;
}

template <typename Sequence, typename T>
Sequence sequence_of(std::vector<T>& items) {
  Sequence out{};
  out._maximum = out._length = static_cast<std::uint32_t>(items.size());
  out._buffer = items.data();
  return out;
}

}  // namespace

FlightPublisher::FlightPublisher(DdsNode& node, const std::string& prefix, std::uint16_t live)
    : state_(node.writer(prefix + "/state", nav_msgs_msg_dds__Odometry__desc, false)),
      set_point_(
          node.writer(prefix + "/set_point", trajectory_msgs_msg_dds__MultiDOFJointTrajectory__desc, false)),
      path_(node.writer(prefix + "/path", nav_msgs_msg_dds__Path__desc, false)),
      map_(node.writer(prefix + "/map", nav_msgs_msg_dds__OccupancyGrid__desc, true)),
      client_(live, {"/state", "/trajectory", "/map"},
              [this](const std::string& topic, std::string_view json) { publish(topic, json); }) {}

void FlightPublisher::write(dds_entity_t writer, const void* message) {
  if (dds_write(writer, message) == DDS_RETCODE_OK) ++published_;
}

void FlightPublisher::publish(const std::string& topic, std::string_view json) {
  try {
    const Json said = input::parse_json<Json>(json);
    if (topic == "/state") {
      const nav_msgs_msg_dds__Odometry_ state = odometry_of(said);
      write(state_, &state);
      const Vector3 p = vector_of(said, "ref_x_m", "ref_y_m", "ref_z_m");
      geometry_msgs_msg_dds__Transform_ at{ros_of(p), {0.0, 0.0, 0.0, 1.0}};
      auto speed = twist_of(vector_of(said, "ref_vx_mps", "ref_vy_mps", "ref_vz_mps"));
      auto acceleration = twist_of(vector_of(said, "ref_ax_mps2", "ref_ay_mps2", "ref_az_mps2"));
      trajectory_msgs_msg_dds__MultiDOFJointTrajectoryPoint_ point{};
      point.transforms = {1, 1, &at, false};
      point.velocities = {1, 1, &speed, false};
      point.accelerations = {1, 1, &acceleration, false};
      trajectory_msgs_msg_dds__MultiDOFJointTrajectory_ set_point{};
      set_point.header = header_now();
      char* joint = body.data();
      set_point.joint_names = {1, 1, &joint, false};
      set_point.points = {1, 1, &point, false};
      write(set_point_, &set_point);
    } else if (topic == "/trajectory") {
      std::vector<geometry_msgs_msg_dds__PoseStamped_> poses;
      const std_msgs_msg_dds__Header_ header = header_now();
      for (const Json& pose : said.at("poses")) {
        const Vector3 p = vector_of(pose.at("position"), "x", "y", "z");
        poses.push_back({header, {{p.x(), p.y(), p.z()}, {0.0, 0.0, 0.0, 1.0}}});
      }
      nav_msgs_msg_dds__Path_ path{};
      path.header = header;
      path.poses = sequence_of<decltype(path.poses)>(poses);
      write(path_, &path);
    } else {
      const auto cells = input::from_base64(said.at("data").get<std::string>());
      nav_msgs_msg_dds__OccupancyGrid_ map{};
      map.header = header_now();
      map.info.map_load_time = map.header.stamp;
      map.info.resolution = static_cast<float>(number(said.at("cell_size"), "x"));
      map.info.width = said.at("column_count").get<std::uint32_t>();
      const Vector3 corner = vector_of(said.at("pose").at("position"), "x", "y", "z");
      map.info.origin = {{corner.x(), corner.y(), corner.z()}, {0.0, 0.0, 0.0, 1.0}};
      if (!cells || map.info.width == 0 || cells->size() % map.info.width != 0) throw InputError("no grid");
      map.info.height = static_cast<std::uint32_t>(cells->size() / map.info.width);
      // 255 is the -1 of an int8: unknown, in both.
      std::vector<std::uint8_t> bytes(cells->begin(), cells->end());
      map.data = sequence_of<decltype(map.data)>(bytes);
      write(map_, &map);
    }
  } catch (const std::exception&) {
    ++not_understood_;
  }
}

}  // namespace roborun::feed
