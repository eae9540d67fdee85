#include "platform/app/feed_dds_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "platform/app/options.hpp"
#include "platform/feed/dds_config.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

struct FeedDdsOptions {
  std::string vehicle, port, imu, odometry, live, prefix{"/roborun"}, domain;
  std::vector<std::string> cameras, lidars;
  CLI::Option* prefix_option{};
};

constexpr int kMostDomain = 232;  // port numbers end there
constexpr const char* kProgram = "roborun-feed-dds";

std::string topic_of(const char* option, const std::string& name) {
  const bool is_name = name.size() > 1 && name.size() < 200 && name.front() == '/' && name.back() != '/' &&
                       name.find("//") == std::string::npos &&
                       std::all_of(name.begin(), name.end(), [](char c) {
                         return c == '/' || c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                                (c >= 'A' && c <= 'Z');
                       });
  if (!is_name)
    throw InputError(fmt::format("{}: '{}': must be the whole name of a topic, such as /imu", option, name));
  return name;
}

template <typename Spec>
feed::DdsEye eye_of(const Spec& spec, std::string topic, std::string port) {
  const firmware_if::CameraMount mount = camera_mount(spec.mount);
  feed::DdsEye eye;
  eye.topic = std::move(topic);
  eye.port = std::move(port);
  eye.range_min_m = spec.range_min_m;
  eye.range_m = spec.range_m;
  eye.R_BC = mount.R_BC;
  eye.p_BC_m = mount.p_BC_m;
  return eye;
}

/// image_transport's rule: beside the image.
std::string info_beside(const std::string& image) {
  return image.substr(0, image.rfind('/')) + "/camera_info";
}

void add_eyes(const FeedDdsOptions& options, const sensor_port::VehiclePorts& ports,
              feed::DdsConfig& config) {
  if (options.cameras.empty() && options.lidars.empty()) return;
  if (options.vehicle.empty())
    throw InputError("--camera, --lidar: go with --vehicle: which says where they sit and how far they see");
  const SensorRig rig = vehicle::load_vehicle(options.vehicle).rig;
  const auto check = [&](const char* option, std::size_t given, std::size_t there) {
    if (given > there)
      throw InputError(
          fmt::format("{}: given {} times: the vehicle '{}' has {}", option, given, options.vehicle, there));
  };
  check("--camera", options.cameras.size(), rig.cameras.size());
  check("--lidar", options.lidars.size(), rig.lidars.size());
  for (std::size_t i = 0; i < options.cameras.size(); ++i) {
    const std::vector<std::string> name = input::split(options.cameras[i]);
    if (name.size() > 2)
      throw InputError(fmt::format("--camera: '{}': must be IMAGE or IMAGE,CAMERA_INFO", options.cameras[i]));
    feed::DdsEye eye = eye_of(rig.cameras[i], topic_of("--camera", name[0]), ports.camera(i));
    eye.info = name.size() == 2 ? topic_of("--camera", name[1]) : info_beside(eye.topic);
    config.cameras.push_back(std::move(eye));
  }
  for (std::size_t i = 0; i < options.lidars.size(); ++i) {
    const LidarSpec& spec = rig.lidars[i];
    feed::DdsEye eye = eye_of(spec, topic_of("--lidar", options.lidars[i]), ports.lidar(i));
    eye.most_points = std::size_t{spec.rings} * spec.columns;
    config.lidars.push_back(std::move(eye));
  }
}

feed::DdsConfig dds_config(const FeedDdsOptions& options) {
  refuse_alone(*options.prefix_option, !options.live.empty(), "--live");
  const bool feeds = !options.cameras.empty() || !options.lidars.empty() || !options.imu.empty() ||
                     !options.odometry.empty();
  if (!feeds && options.live.empty())
    throw InputError("--camera, --lidar, --imu, --odometry, --live: at least one of them must be given");
  if (feeds && options.port.empty())
    throw InputError("--port: must be given: the vehicle's name among the ports");
  feed::DdsConfig config;
  const char* const environment = std::getenv("ROS_DOMAIN_ID");  // NOLINT(concurrency-mt-unsafe): one thread
  if (!options.domain.empty())
    config.domain = input::whole_of("--domain", options.domain, 0, kMostDomain);
  else if (environment != nullptr && *environment != '\0')
    config.domain = input::whole_of("ROS_DOMAIN_ID", environment, 0, kMostDomain);
  const sensor_port::VehiclePorts ports(options.port);
  add_eyes(options, ports, config);
  if (!options.imu.empty()) config.imu = topic_of("--imu", options.imu);
  config.imu_port = ports.imu();
  if (!options.odometry.empty()) config.odometry = topic_of("--odometry", options.odometry);
  config.odometry_port = ports.odometry();
  if (!options.live.empty()) config.live = input::whole_of("--live", options.live, 1, 65535);
  config.prefix = topic_of("--prefix", options.prefix);
  std::vector<std::string> topics;
  for (const feed::DdsEye& eye : config.cameras) topics.insert(topics.end(), {eye.topic, eye.info});
  for (const feed::DdsEye& eye : config.lidars) topics.push_back(eye.topic);
  for (const std::string& topic : {config.imu, config.odometry})
    if (!topic.empty()) topics.push_back(topic);
  refuse_twice("topics", topics);
  return config;
}

/// Beside the program in a build, in lib/roborun where it is installed.
std::filesystem::path program_path() {
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const std::filesystem::path beside = folder / kProgram;
  const std::filesystem::path installed = folder.parent_path() / "lib" / "roborun" / kProgram;
  for (const auto& path : {beside, installed})
    if (access(path.c_str(), X_OK) == 0) return path;
  throw InputError(
      fmt::format("{} is not there: must be built with cyclonedds-dev and cyclonedds-tools installed "
                  "(toolchain/setup)",
                  beside.string()));
}

int feed_dds(const FeedDdsOptions& options) {
  std::string text = nlohmann::json(dds_config(options)).dump();
  std::string program = program_path().string();
  std::array<char*, 3> arguments{program.data(), text.data(), nullptr};
  (void)execv(program.c_str(), arguments.data());
  throw InputError(fmt::format("{}: {}", program, strerror(errno)));
}

}  // namespace

void add_feed_dds_command(CLI::App& feed, std::function<int()>& run) {
  const auto options = std::make_shared<FeedDdsOptions>();
  CLI::App* dds = feed.add_subcommand("dds", "ROS 2 topics, through Cyclone DDS and without ROS");
  dds->footer(
      "Each --camera is the vehicle's next one, and goes to the port NAME-camera1, NAME-camera2 ...: place "
      "and "
      "ranges are the vehicle file's, optics its CameraInfo's. So with --lidar. --imu goes to NAME-imu, "
      "--odometry to "
      "NAME-odometry, as roborun run --link port:NAME asks for them. Stamps have to be of this machine's "
      "wall "
      "clock. What cannot be used is left out and counted, with a line for the first of its kind.\n\n"
      "  --camera    sensor_msgs/Image, rectified, 16UC1 (mm) or 32FC1 (m); CameraInfo beside it, or behind "
      "a comma\n"
      "  --lidar     sensor_msgs/PointCloud2, axes forward, left, up\n"
      "  --imu       sensor_msgs/Imu in the body's axes (forward, left, up)\n"
      "  --odometry  nav_msgs/Odometry of the body, with a covariance\n\n"
      "With --live PORT a flight (roborun run --log FILE.mcap --live PORT) is published: PREFIX/state "
      "(nav_msgs/Odometry), PREFIX/set_point (trajectory_msgs/MultiDOFJointTrajectory), PREFIX/path "
      "(nav_msgs/Path) "
      "and PREFIX/map (nav_msgs/OccupancyGrid), in the frame world.\n"
      "Cyclone DDS reads CYCLONEDDS_URI: network interfaces, peers.\n\n"
      "Example, with a RealSense camera (ros2 launch realsense2_camera rs_launch.py), in two terminals:\n"
      "  roborun feed dds --vehicle x500 --port demo --camera /camera/camera/depth/image_rect_raw\n"
      "  roborun port check demo-camera1\n\n"
      "Exit code: 2 bad input, or no Cyclone DDS, 130 interrupted.");
  dds->add_option("--vehicle", options->vehicle, "shipped vehicle, or a file; of --camera and --lidar");
  dds->add_option("--port", options->port, "NAME: what the vehicle is called among the ports");
  dds->add_option("--camera", options->cameras, "topic of depth images, or IMAGE,CAMERA_INFO; several")
      ->take_all();
  dds->add_option("--lidar", options->lidars, "topic of a LiDAR's clouds; several")->take_all();
  dds->add_option("--imu", options->imu, "topic of the IMU");
  dds->add_option("--odometry", options->odometry, "topic of odometry");
  dds->add_option("--live", options->live, "PORT of a flight's live view, which is published");
  options->prefix_option =
      dds->add_option("--prefix", options->prefix, "of what is published")->capture_default_str();
  dds->add_option("--domain", options->domain, "0 .. 232; default: ROS_DOMAIN_ID, or 0");
  dds->callback([options, &run] { run = [options] { return feed_dds(*options); }; });
}

}  // namespace roborun::app
