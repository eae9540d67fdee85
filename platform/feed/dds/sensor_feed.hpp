/// ROS 2 topics at sensor ports.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "platform/feed/dds/dds_node.hpp"
#include "platform/feed/dds/ros_clock.hpp"
#include "platform/feed/dds/ros_samples.hpp"
#include "platform/feed/dds_config.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::feed {

/// Whoever publishes a topic, one at a time: another one is heard once the first was silent for half a second.
class OneSender {
 public:
  enum class Is : std::uint8_t { kKnown, kNew, kAnother };
  /// kNew: the first one, or one in the place of another that is silent.
  [[nodiscard]] Is hear(std::uint64_t sender, Nanos now);

 private:
  std::optional<std::uint64_t> sender_;
  Nanos heard_{};
};

/// One thread. Throws InputError where a port or a topic cannot be made.
class SensorFeed {
 public:
  /// `say`: one line each: the first refusal of a kind, a topic on which nothing comes.
  SensorFeed(DdsNode& node, const DdsConfig& config, std::function<void(const std::string&)> say);
  SensorFeed(const SensorFeed&) = delete;
  SensorFeed& operator=(const SensorFeed&) = delete;

  /// All that has come.
  void step();
  /// A line per topic: how many were taken and refused, and why.
  [[nodiscard]] std::vector<std::string> totals() const;

 private:
  struct Message {
    const void* content;
    ClockPair now;
    bool is_new_sender;
  };
  using Take = std::function<std::optional<Refused>(const Message&)>;
  struct Topic {
    std::string name;
    dds_entity_t reader;
    Take take;
    OneSender sender{};
    std::uint64_t taken{};
    std::map<std::string, std::uint64_t> refused{};  ///< By kind.
    bool was_heard{false}, is_missed{false};
  };
  struct Camera {
    DdsEye eye;
    std::optional<RosOptics> optics{};
    sensor_port::PortWriter port{};
    roborun_port_depth header{};
    std::vector<std::byte> room{};
    std::span<const std::byte> pixels{};
  };
  struct Lidar {
    DdsEye eye;
    sensor_port::PortWriter port{};
    roborun_port_cloud header{};
    std::vector<roborun_port_point> points{};
  };

  void hear(const std::string& name, const dds_topic_descriptor_t& type, int depth, Take take);
  void add_camera(const DdsEye& eye);
  void add_lidar(const DdsEye& eye);
  void add_imu(const DdsConfig& config);
  void add_odometry(const DdsConfig& config);
  [[nodiscard]] std::optional<Refused> write_image(Camera& camera, const Message& message);
  [[nodiscard]] std::optional<Refused> write_cloud(Lidar& lidar, const Message& message);
  /// The stamp of a message's header.
  template <typename Ros>
  [[nodiscard]] std::optional<Refused> stamp(const Ros& ros, const Message& message, roborun_port_stamp& at) {
    ++at.sequence;
    return clock_.take(ros.header.stamp.sec, ros.header.stamp.nanosec, message.now, at.stamp_ns);
  }
  void drain(Topic& topic);
  void refuse(Topic& topic, const Refused& refused);

  DdsNode& node_;
  std::function<void(const std::string&)> say_;
  RosClock clock_;
  Nanos begun_;
  std::deque<Topic> topics_;
  std::deque<Camera> cameras_;
  std::deque<Lidar> lidars_;
  sensor_port::PortWriter imu_port_, odometry_port_;
  roborun_port_imu imu_{};
  roborun_port_odometry odometry_{};
};

}  // namespace roborun::feed
