// A node of a ROS 2 domain, as a driver would be: publishes a camera, an IMU and odometry on /test. usage: dds_publisher DOMAIN good|bad SECONDS
#include <dds/dds.h>
#include <ros2_messages.h>
#include <time.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr std::uint32_t kWidth = 16, kHeight = 12, kStep = 40;  // 32 bytes of pixels, 8 of padding
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

dds_entity_t writer(dds_entity_t participant, const char* topic, const dds_topic_descriptor_t& type) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  const dds_entity_t made = dds_create_topic(participant, &type, topic, nullptr, nullptr);
  const dds_entity_t result = made < 0 ? made : dds_create_writer(participant, made, qos, nullptr);
  dds_delete_qos(qos);
  if (result < 0) {
    std::fprintf(stderr, "%s: %s\n", topic, dds_strretcode(-result));
    std::exit(1);
  }
  return result;
}

std_msgs_msg_dds__Header_ header(const char* frame, double shift_s = 0.0) {
  timespec now{};
  (void)clock_gettime(CLOCK_REALTIME, &now);
  return {{static_cast<std::int32_t>(static_cast<double>(now.tv_sec) + shift_s),
           static_cast<std::uint32_t>(now.tv_nsec)},
          const_cast<char*>(frame)};
}

struct Node {
  explicit Node(dds_entity_t participant)
      : image(writer(participant, "rt/test/depth/image", sensor_msgs_msg_dds__Image__desc)),
        info(writer(participant, "rt/test/depth/camera_info", sensor_msgs_msg_dds__CameraInfo__desc)),
        imu(writer(participant, "rt/test/imu", sensor_msgs_msg_dds__Imu__desc)),
        odometry(writer(participant, "rt/test/odom", nav_msgs_msg_dds__Odometry__desc)) {}

  void send_info(double fx = 16.0, double d0 = 0.0) const {
    sensor_msgs_msg_dds__CameraInfo_ m{};
    std::array<double, 5> d{d0};
    m.header = header("camera_depth_optical_frame");
    m.width = kWidth;
    m.height = kHeight;
    m.distortion_model = const_cast<char*>("plumb_bob");
    m.d = {5, 5, d.data(), false};
    m.k[0] = m.k[4] = fx;
    m.k[2] = 7.5;
    m.k[5] = 5.5;
    m.k[8] = 1.0;
    (void)dds_write(info, &m);
  }
  void send_image(const char* encoding, std::uint32_t step, std::uint32_t rows, double shift_s = 0.0) const {
    std::vector<std::uint8_t> data(kStep * rows, 0xEE);
    for (std::uint32_t v = 0; v < rows; ++v)
      for (std::uint32_t u = 0; u < kWidth; ++u) {
        data[v * kStep + 2 * u] = 2500 & 0xFF;
        data[v * kStep + 2 * u + 1] = 2500 >> 8;
      }
    sensor_msgs_msg_dds__Image_ m{};
    m.header = header("camera_depth_optical_frame", shift_s);
    m.width = kWidth;
    m.height = kHeight;
    m.encoding = const_cast<char*>(encoding);
    m.step = step;
    m.data = {static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(data.size()), data.data(),
              false};
    (void)dds_write(image, &m);
  }
  void send_imu(const char* frame, double rate_radps, double shift_s = 0.0) const {
    sensor_msgs_msg_dds__Imu_ m{};
    m.header = header(frame, shift_s);
    m.orientation_covariance[0] = -1.0;
    m.angular_velocity = {rate_radps, 0.0, 0.25};
    m.linear_acceleration = {0.0, 0.5, 9.81};
    (void)dds_write(imu, &m);
  }
  void send_odometry(double w, double variance) const {
    nav_msgs_msg_dds__Odometry_ m{};
    m.header = header("odom");
    m.child_frame_id = const_cast<char*>("base_link");
    m.pose.pose = {{1.0, 2.0, 3.0}, {0.0, 0.0, std::sqrt(0.5), w}};  // turned to the left by 90 degrees
    m.twist.twist.linear = {2.0, 0.0, 0.0};
    for (std::size_t i = 0; i < 6; ++i) m.pose.covariance[7 * i] = variance;
    (void)dds_write(odometry, &m);
  }
  void send_good() const {
    send_info();
    send_image("16UC1", kStep, kHeight);
    send_imu("imu_link", 0.5);
    send_odometry(std::sqrt(0.5), 0.04);
  }
  void send_bad() const {
    send_info(kNaN);
    send_info(16.0, 0.1);
    send_image("rgb8", kStep, kHeight);
    send_image("16UC1", 31, kHeight);
    send_image("16UC1", 4'000'000'000U, kHeight);
    send_image("16UC1", kStep, kHeight - 1);
    send_image("16UC1", kStep, kHeight, -1000.0);
    send_imu("imu_link", kNaN);
    send_imu("camera_imu_optical_frame", 0.5);
    send_imu("imu_link", 0.5, 1000.0);
    send_odometry(kNaN, 0.04);
    send_odometry(2.0, 0.04);
    send_odometry(std::sqrt(0.5), 0.0);
    send_odometry(std::sqrt(0.5), -1.0);
  }

  dds_entity_t image, info, imu, odometry;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const auto domain = static_cast<dds_domainid_t>(std::atoi(argv[1]));
  const std::string what = argv[2];
  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  if (participant < 0) return 1;
  const Node node(participant);
  // Bytes of another type under the names of this one: what a program with another layout sends.
  dds_topic_descriptor_t liar = std_msgs_msg_dds__Header__desc;
  liar.m_typename = sensor_msgs_msg_dds__PointCloud2__desc.m_typename;
  const dds_entity_t cloud = writer(participant, "rt/test/points", liar);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[3]));
  while (std::chrono::steady_clock::now() < end) {
    node.send_good();
    if (what == "bad") {
      node.send_bad();
      const auto lie = header("lidar");
      (void)dds_write(cloud, &lie);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  (void)dds_delete(participant);
  return 0;
}
