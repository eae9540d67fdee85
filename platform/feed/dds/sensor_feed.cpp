#include "platform/feed/dds/sensor_feed.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace roborun::feed {
namespace {

constexpr Nanos kSilent{500'000'000};
constexpr Nanos kMissed{5'000'000'000};
constexpr std::uint32_t kPictureSlots = 4;
constexpr std::uint32_t kSampleSlots = 1024;
// What waits while another topic is served.
constexpr int kPicturesDeep = 10, kSamplesDeep = 1024;

/// What the vehicle file says of it; `header` is of a depth image or a cloud.
template <typename Header>
void put_eye(const DdsEye& eye, Header& header) {
  header.range_min_m = static_cast<float>(eye.range_min_m);
  header.range_m = static_cast<float>(eye.range_m);
  header.mount = sensor_port::port_mount({eye.R_BC, eye.p_BC_m});
}

}  // namespace

OneSender::Is OneSender::hear(std::uint64_t sender, Nanos now) {
  if (sender_ && *sender_ != sender && now - heard_ < kSilent) return Is::kAnother;
  heard_ = now;
  return std::exchange(sender_, sender) == sender ? Is::kKnown : Is::kNew;
}

SensorFeed::SensorFeed(DdsNode& node, const DdsConfig& config, std::function<void(const std::string&)> say)
    : node_(node), say_(std::move(say)), begun_(clocks_now().monotonic) {
  for (const DdsEye& eye : config.cameras) add_camera(eye);
  for (const DdsEye& eye : config.lidars) add_lidar(eye);
  if (!config.imu.empty()) add_imu(config);
  if (!config.odometry.empty()) add_odometry(config);
}

void SensorFeed::hear(const std::string& name, const dds_topic_descriptor_t& type, int depth, Take take) {
  topics_.push_back({name, node_.reader(name, type, depth), std::move(take)});
}

void SensorFeed::add_camera(const DdsEye& eye) {
  Camera& camera = cameras_.emplace_back();
  camera.eye = eye;
  put_eye(eye, camera.header);
  hear(eye.info, sensor_msgs_msg_dds__CameraInfo__desc, kPicturesDeep, [&camera](const Message& message) {
    RosOptics optics;
    auto refused = optics_of(*static_cast<const RosCameraInfo*>(message.content), optics);
    if (!refused) camera.optics = optics;
    return refused;
  });
  hear(eye.topic, sensor_msgs_msg_dds__Image__desc, kPicturesDeep,
       [this, &camera](const Message& message) { return write_image(camera, message); });
}

std::optional<Refused> SensorFeed::write_image(Camera& camera, const Message& message) {
  const auto& image = *static_cast<const RosImage*>(message.content);
  if (auto refused = stamp(image, message, camera.header.at)) return refused;
  if (!camera.optics) return Refused{"optics", fmt::format("no CameraInfo came on {} yet", camera.eye.info)};
  if (auto refused = depth_of(image, *camera.optics, camera.room, camera.header, camera.pixels))
    return refused;
  if (!camera.port.is_open())
    sensor_port::open_port(camera.port, camera.eye.port, ROBORUN_PORT_DEPTH,
                           sizeof(float) * camera.optics->width * camera.optics->height, kPictureSlots);
  if (!camera.port.write(camera.header, camera.pixels))
    return Refused{"size", "it is larger than the first one: start the feeder again"};
  return std::nullopt;
}

void SensorFeed::add_lidar(const DdsEye& eye) {
  Lidar& lidar = lidars_.emplace_back();
  lidar.eye = eye;
  put_eye(eye, lidar.header);
  sensor_port::open_port(lidar.port, eye.port, ROBORUN_PORT_CLOUD,
                         sizeof(roborun_port_point) * eye.most_points, kPictureSlots);
  hear(eye.topic, sensor_msgs_msg_dds__PointCloud2__desc, kPicturesDeep,
       [this, &lidar](const Message& message) { return write_cloud(lidar, message); });
}

std::optional<Refused> SensorFeed::write_cloud(Lidar& lidar, const Message& message) {
  const auto& cloud = *static_cast<const RosCloud*>(message.content);
  double late_s = 0.0;
  if (auto refused = stamp(cloud, message, lidar.header.at)) return refused;
  if (auto refused = cloud_of(cloud, lidar.eye.most_points, lidar.points, late_s)) return refused;
  const Nanos ahead = Nanos{lidar.header.at.stamp_ns} + from_seconds(late_s) - message.now.monotonic;
  if (ahead > RosClock::kMostAhead)
    return Refused{"stamp",
                   fmt::format("its last point is {:.3f} s ahead of this machine's clock", seconds(ahead))};
  lidar.header.at.stamp_ns = (message.now.monotonic + std::min(ahead, Nanos{0})).count();
  lidar.header.points = static_cast<std::uint32_t>(lidar.points.size());
  lidar.port.write(lidar.header, std::as_bytes(std::span(lidar.points)));
  return std::nullopt;
}

void SensorFeed::add_imu(const DdsConfig& config) {
  sensor_port::open_port(imu_port_, config.imu_port, ROBORUN_PORT_IMU, 0, kSampleSlots);
  hear(config.imu, sensor_msgs_msg_dds__Imu__desc, kSamplesDeep, [this](const Message& message) {
    const auto& imu = *static_cast<const RosImu*>(message.content);
    auto refused = stamp(imu, message, imu_.at);
    if (!refused) refused = imu_of(imu, imu_);
    if (!refused) imu_port_.write(imu_);
    return refused;
  });
}

void SensorFeed::add_odometry(const DdsConfig& config) {
  sensor_port::open_port(odometry_port_, config.odometry_port, ROBORUN_PORT_ODOMETRY, 0, kSampleSlots);
  hear(config.odometry, nav_msgs_msg_dds__Odometry__desc, kSamplesDeep, [this](const Message& message) {
    const auto& odometry = *static_cast<const RosOdometry*>(message.content);
    odometry_.reset_counter += message.is_new_sender ? 1 : 0;  // another one, or again: its frame begins anew
    auto refused = stamp(odometry, message, odometry_.at);
    if (!refused) refused = odometry_of(odometry, odometry_);
    if (!refused) odometry_port_.write(odometry_);
    return refused;
  });
}

void SensorFeed::refuse(Topic& topic, const Refused& refused) {
  if (++topic.refused[refused.kind] == 1) say_(fmt::format("{}: left out: {}", topic.name, refused.text));
}

void SensorFeed::drain(Topic& topic) {
  constexpr std::size_t kAtOnce = 8;
  std::array<void*, kAtOnce> samples{};
  std::array<dds_sample_info_t, kAtOnce> infos{};
  for (;;) {
    samples.fill(nullptr);
    const dds_return_t count = dds_take(topic.reader, samples.data(), infos.data(), kAtOnce, kAtOnce);
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (!infos.at(i).valid_data) continue;  // of a publisher that ended
      topic.was_heard = true;
      const ClockPair now = clocks_now();
      const OneSender::Is sender = topic.sender.hear(infos.at(i).publication_handle, now.monotonic);
      std::optional<Refused> refused;
      if (sender == OneSender::Is::kAnother)
        refused = Refused{"sender", "more than one node publishes it: only the first one is heard"};
      else
        refused = topic.take({samples.at(i), now, sender == OneSender::Is::kNew});
      if (refused)
        refuse(topic, *refused);
      else
        ++topic.taken;
    }
    (void)dds_return_loan(topic.reader, samples.data(), count);
  }
}

void SensorFeed::step() {
  for (Topic& topic : topics_) {
    drain(topic);
    if (topic.was_heard || topic.is_missed || clocks_now().monotonic - begun_ < kMissed) continue;
    topic.is_missed = true;
    say_(fmt::format(
        "{}: nothing came for {:.0f} s: is it published, with that type, in this domain (ROS_DOMAIN_ID)?",
        topic.name, seconds(kMissed)));
  }
}

std::vector<std::string> SensorFeed::totals() const {
  std::vector<std::string> lines;
  for (const Topic& topic : topics_) {
    std::string line = fmt::format("{}: {} taken", topic.name, topic.taken);
    for (const auto& [kind, count] : topic.refused) line += fmt::format(", {} left out ({})", count, kind);
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace roborun::feed
