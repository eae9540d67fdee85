#include "platform/app/feed_v4l2_command.hpp"

#include <fmt/format.h>

#include <memory>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/recording_arguments.hpp"
#include "platform/feed/v4l2_feed.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/vehicle/vehicle_file.hpp"

namespace roborun::app {
namespace {

struct FeedV4l2Options {
  std::string device, port, vehicle, intrinsics;
  int camera{1};
  double unit_m{0.001}, range_m{10.0};
  CLI::Option *camera_option{}, *unit_option{}, *range_option{};
};

feed::V4l2FeedConfig feed_config(const FeedV4l2Options& options) {
  refuse_alone(*options.camera_option, !options.vehicle.empty(), "--vehicle");
  refuse_alone(*options.range_option, options.vehicle.empty(),
               "--intrinsics alone: the vehicle file has a range");
  feed::V4l2FeedConfig config;
  config.wish.device = options.device;
  config.wish.takes_y16 = options.unit_option->count() > 0;
  config.unit_m = options.unit_m;
  config.port = sensor_port::port_path(options.port);
  if (options.vehicle.empty() && options.intrinsics.empty())
    throw InputError("--vehicle, --intrinsics: one of them must be given: what the camera sees");
  if (!options.intrinsics.empty()) config.intrinsics = intrinsics_of(options.intrinsics);
  config.camera.range_m = options.range_m;
  if (options.vehicle.empty()) return config;
  const SensorRig rig = vehicle::load_vehicle(options.vehicle).rig;
  const auto index = static_cast<std::size_t>(options.camera - 1);
  if (index >= rig.cameras.size())
    throw InputError(fmt::format("--camera: {}: the vehicle '{}' has {} cameras", options.camera,
                                 options.vehicle, rig.cameras.size()));
  config.camera = rig.cameras[index];
  config.wish.width = config.camera.width;
  config.wish.height = config.camera.height;
  return config;
}

int feed_v4l2(const FeedV4l2Options& options) {
  feed::V4l2FeedConfig config = feed_config(options);
  const input::StopOnSignal stop;
  config.stop = &input::StopOnSignal::requested;
  config.say = [](const std::string& line) { fmt::print(stderr, "roborun: {}\n", line); };
  feed::LinuxVideo calls;
  const feed::V4l2FeedCounters counters = feed::feed_v4l2(calls, config);
  fmt::print("{} images, {} damaged ones left out, {} times lost\n", counters.images, counters.damaged,
             counters.losses);
  return kInterrupted;
}

}  // namespace

void add_feed_v4l2_command(CLI::App& feed, std::function<int()>& run) {
  const auto options = std::make_shared<FeedV4l2Options>();
  CLI::App* v4l2 = feed.add_subcommand("v4l2", "A depth camera of the kernel (Video4Linux, Z16 or Y16)");
  v4l2->footer(
      "With --vehicle: size, optics, ranges and place are those of that camera, as roborun run will ask; "
      "--intrinsics are measured ones instead of its angles. Without: the size that the device is set to "
      "(v4l2-ctl --set-fmt-video), and the camera is the body. Images are written as they come: the map "
      "takes "
      "the least and the most of each rectangle, so that a thin pole does not vanish. Stamps are the "
      "driver's.\n"
      "Y16 is taken only where --unit-m says what a number means: it may be the picture of an infrared "
      "camera.\n"
      "A camera that is lost or silent for 2 s is opened again once per second; after a minute the command "
      "ends.\n\n"
      "Example, in two terminals (v4l2-ctl --list-devices says which device gives depth):\n"
      "  roborun feed v4l2 /dev/video2 --vehicle x500 --port demo-camera1\n"
      "  roborun port check demo-camera1\n\n"
      "Exit code: 2 bad input, no such camera, or one that was lost for a minute, 130 interrupted.");
  v4l2->add_option("device", options->device, "such as /dev/video2")->required();
  v4l2->add_option("--port", options->port, "of the images: NAME, or a file")->required();
  v4l2->add_option("--vehicle", options->vehicle, "shipped vehicle, or a file (roborun vehicle list)");
  options->camera_option = add_whole(*v4l2, "--camera", options->camera, 1, static_cast<int>(kMostCameras),
                                     "which one of the vehicle's");
  v4l2->add_option("--intrinsics", options->intrinsics, "FX,FY,CX,CY in pixels");
  options->range_option = add_number(*v4l2, "--range", options->range_m, 0.5, 300.0,
                                     "what is farther is not looked at, metres; without --vehicle");
  options->unit_option =
      add_number(*v4l2, "--unit-m", options->unit_m, 1e-6, 0.1, "metres of one step of a pixel's number");
  v4l2->callback([options, &run] { run = [options] { return feed_v4l2(*options); }; });
}

}  // namespace roborun::app
