#include "platform/feed/dds/flight_publisher.hpp"

#include <gtest/gtest.h>
#include <ros2_messages.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "platform/feed/dds/ros_clock.hpp"
#include "platform/log/flight_log.hpp"
#include "platform/viewer/live_server.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::feed {
namespace {

/// A domain on loopback that other tests do not share.
int loopback_domain() {
  (void)setenv(
      "CYCLONEDDS_URI",
      "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
      "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
      "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery></Domain></CycloneDDS>",
      1);
  return 1 + getpid() % 200;
}

/// The newest message of a topic.
template <typename Ros>
class Heard {
 public:
  Heard(DdsNode& node, const std::string& topic, const dds_topic_descriptor_t& type)
      : reader_(node.reader(topic, type, 10)) {}
  ~Heard() { release(); }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;
  bool take() {
    void* sample = nullptr;
    dds_sample_info_t info{};
    if (dds_take(reader_, &sample, &info, 1, 1) != 1) return message_ != nullptr;
    release();
    message_ = static_cast<Ros*>(sample);
    return true;
  }
  const Ros& operator*() const { return *message_; }
  const Ros* operator->() const { return message_; }

 private:
  void release() {
    void* sample = message_;
    if (sample != nullptr) (void)dds_return_loan(reader_, &sample, 1);
  }
  dds_entity_t reader_;
  Ros* message_{};
};

TEST(FlightPublisher, ShowsAFlightToRos) {
  const int domain = loopback_domain();
  DdsNode ros(domain);  // another participant: it hears over the network
  Heard<nav_msgs_msg_dds__Odometry_> state(ros, "/roborun/state", nav_msgs_msg_dds__Odometry__desc);
  Heard<trajectory_msgs_msg_dds__MultiDOFJointTrajectory_> set_point(
      ros, "/roborun/set_point", trajectory_msgs_msg_dds__MultiDOFJointTrajectory__desc);
  Heard<nav_msgs_msg_dds__Path_> path(ros, "/roborun/path", nav_msgs_msg_dds__Path__desc);
  Heard<nav_msgs_msg_dds__OccupancyGrid_> map(ros, "/roborun/map", nav_msgs_msg_dds__OccupancyGrid__desc);

  viewer::LiveServer server(0, [] { return std::string("page"); });
  log::FlightLog log(test::scratch("flight.mcap"), false);
  log.show_to(server);
  DdsNode node(domain);
  FlightPublisher sut(node, "/roborun", server.port());

  log::StateRecord record;
  record.p_WB = {1.0, 2.0, 3.0};
  record.v_WB = {0.0, 2.0, 0.0};
  record.w_WB_B = {0.1, 0.2, 0.3};
  record.q_WB = {std::sqrt(0.5), 0.0, 0.0, std::sqrt(0.5)};
  record.position_sigma_m = 0.5;
  record.reference_p_W = {4.0, 5.0, 6.0};
  record.reference_v_W = {0.0, 1.5, 0.0};
  record.reference_a_W = {0.0, 0.0, 0.25};
  log::DecisionEntry decision;
  decision.points = 2;
  decision.point_W[0] = {1.0, 2.0, 3.0};
  decision.point_W[1] = {7.0, 8.0, 9.0};
  log::MapSlice slice;
  slice.x_m = -4.0;
  slice.y_m = -5.0;
  slice.z_m = 3.0;
  slice.cell_m = 0.5;
  slice.columns = 3;
  slice.rows = 2;
  slice.cell = {0, 100, 255, 255, 0, 0};
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  bool all = false;
  for (int i = 0; !all && std::chrono::steady_clock::now() < end; ++i) {
    record.time_ns = decision.time_ns = slice.time_ns = i * 25'000'000LL;
    log.write(record);
    log.write(decision);
    log.write(slice);
    sut.step(clocks_now().monotonic.count());
    ros.wait(20'000'000);
    all = state.take() && set_point.take() && path.take() && map.take();
  }
  ASSERT_TRUE(all);
  EXPECT_TRUE(sut.is_connected());
  EXPECT_EQ(sut.not_understood(), 0U);
  EXPECT_GE(sut.published(), 4U);

  EXPECT_STREQ(state->header.frame_id, "world");
  EXPECT_NEAR(state->header.stamp.sec, static_cast<double>(clocks_now().wall.count()) * 1e-9, 100.0);
  EXPECT_STREQ(state->child_frame_id, "body");
  EXPECT_EQ(state->pose.pose.position.z, 3.0);
  EXPECT_NEAR(state->pose.pose.orientation.z, std::sqrt(0.5), 1e-4);
  EXPECT_NEAR(state->pose.covariance[14], 0.25, 1e-9);
  EXPECT_NEAR(state->twist.twist.linear.x, 2.0, 1e-3) << "of the body: it flies forward";
  EXPECT_NEAR(state->twist.twist.linear.y, 0.0, 1e-3);
  EXPECT_NEAR(state->twist.twist.angular.z, 0.3, 1e-3);

  ASSERT_EQ(set_point->points._length, 1U);
  const auto& point = set_point->points._buffer[0];
  ASSERT_EQ(point.transforms._length, 1U);
  EXPECT_EQ(point.transforms._buffer[0].translation.x, 4.0);
  EXPECT_EQ(point.velocities._buffer[0].linear.y, 1.5);
  EXPECT_EQ(point.accelerations._buffer[0].linear.z, 0.25);

  ASSERT_EQ(path->poses._length, 2U);
  EXPECT_EQ(path->poses._buffer[1].pose.position.y, 8.0);
  EXPECT_STREQ(path->poses._buffer[1].header.frame_id, "world");

  EXPECT_EQ(map->info.width, 3U);
  EXPECT_EQ(map->info.height, 2U);
  EXPECT_FLOAT_EQ(map->info.resolution, 0.5F);
  EXPECT_EQ(map->info.origin.position.x, -4.0);
  ASSERT_EQ(map->data._length, 6U);
  EXPECT_EQ(static_cast<std::int8_t>(map->data._buffer[2]), -1);
  EXPECT_EQ(map->data._buffer[1], 100);
}

TEST(LiveClient, WaitsForAServerThatIsNotThere) {
  LiveClient sut(1, {"/state"}, [](const std::string&, std::string_view) { FAIL(); });
  for (int i = 0; i < 3; ++i) sut.step(i * 2'000'000'000LL);
  EXPECT_FALSE(sut.is_connected());
}

}  // namespace
}  // namespace roborun::feed
