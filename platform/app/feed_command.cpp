#include "platform/app/feed_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "platform/app/exit_code.hpp"
#include "platform/app/feed_dds_command.hpp"
#include "platform/app/feed_v4l2_command.hpp"
#include "platform/app/options.hpp"
#include "platform/app/plant_arguments.hpp"
#include "platform/app/recording_arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/live/pictures.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::app {
namespace {

constexpr std::uint32_t kSlots = 8;

struct FeedFilesOptions {
  RecordingArguments recording;
  std::string port, odometry;
  double rate_Hz{10.0};
  bool loop{false};
};

/// The camera is the body. The speed is what led here from the pose before.
roborun_port_odometry odometry_of(const Pose& X_WB, const Pose& before, double step_s,
                                  const roborun_port_stamp& at) {
  roborun_port_odometry o{};
  o.at = at;
  const Quaternion q(X_WB.R_RT);
  const Vector3 v_W = (X_WB.p_RT - before.p_RT) / step_s;
  for (int i = 0; i < 3; ++i) {
    o.p_OB_m[i] = X_WB.p_RT[i];
    o.v_OB_mps[i] = v_W[i];
  }
  o.q_OB[0] = q.w();
  o.q_OB[1] = q.x();
  o.q_OB[2] = q.y();
  o.q_OB[3] = q.z();
  return o;
}

int feed_files(const FeedFilesOptions& options) {
  using Clock = std::chrono::steady_clock;
  dataset::Recording recording(options.recording.from, recording_options(options.recording));
  if (recording.has_clouds())
    throw InputError(fmt::format("{}: holds clouds: must be depth images", options.recording.from));
  // All images are of one size.
  sensor_port::PortWriter images, odometry;
  sensor_port::open_port(images, sensor_port::port_path(options.port), ROBORUN_PORT_DEPTH,
                         recording.load(0).front().frame.depth_m.size_bytes(), kSlots);
  if (!options.odometry.empty())
    sensor_port::open_port(odometry, sensor_port::port_path(options.odometry), ROBORUN_PORT_ODOMETRY, 0,
                           kSlots);
  const double step_s = 1.0 / options.rate_Hz;
  const input::StopOnSignal stop;
  report::ProgressLine line;
  roborun_port_stamp at{};
  std::uint32_t round = 0;
  Pose before = recording.load(0).front().X_WC;
  auto due = Clock::now();
  for (std::size_t i = 0; !input::StopOnSignal::requested(); ++i) {
    if (i == recording.size()) {
      if (!options.loop) break;
      i = 0;
      ++round;
    }
    const stages::PosedDepthFrame& posed = recording.load(i).front();
    std::this_thread::sleep_until(due);
    due = std::max(due + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(step_s)),
                   Clock::now());
    at.stamp_ns = std::chrono::nanoseconds(Clock::now().time_since_epoch()).count();
    ++at.sequence;
    images.write(sensor_port::depth_header(posed.frame, at), std::as_bytes(posed.frame.depth_m));
    if (odometry.is_open()) {
      roborun_port_odometry o = odometry_of(posed.X_WC, i == 0 ? posed.X_WC : before, step_s, at);
      o.reset_counter = round;  // from the last pose back to the first
      odometry.write(o);
    }
    before = posed.X_WC;
    if (line.due())
      line.show(fmt::format("{} of {} images, {:.0f} s", i + 1, recording.size(), line.elapsed_s()));
  }
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

int feed_plant(const PlantArguments& arguments) {
  live::PictureFeed config;
  const PlantScene scene = plant_scene(arguments);
  config.mission = scene.mission;
  config.port = arguments.port;
  const input::StopOnSignal stop;
  config.stop = &input::StopOnSignal::requested;
  const std::uint64_t sent = live::feed_pictures(scene.world, config);
  fmt::print("{} pictures sent\n", sent);
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

void add_feed_plant(CLI::App& feed, std::function<int()>& run) {
  const auto options = std::make_shared<PlantArguments>();
  CLI::App* plant =
      feed.add_subcommand("plant", "What the cameras and LiDARs of a plant see, as a process of its own");
  plant->footer(
      "With the plant's own vehicle, world and seed, or its scenario. Ends with the plant; may be started "
      "again in flight.\n\n"
      "Example, in three terminals:\n"
      "  roborun plant --env 14 --port demo --no-pictures\n"
      "  roborun feed plant --env 14 --port demo\n"
      "  roborun run --link port:demo --goal 900,0,5 --bounds=-100,-100,1.5,1000,100,10\n\n"
      "Exit code: 0 the plant has ended, 2 bad input, or no plant, 130 interrupted.");
  add_plant_arguments(*plant, *options);
  plant->callback([options, &run] { run = [options] { return feed_plant(*options); }; });
}

}  // namespace

void add_feed_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* feed = app.add_subcommand("feed", "Feeders: processes that write to sensor ports (roborun port)");
  feed->require_subcommand(1);
  add_feed_v4l2_command(*feed, run);
  add_feed_dds_command(*feed, run);
  add_feed_plant(*feed, run);
  const auto options = std::make_shared<FeedFilesOptions>();
  CLI::App* files = feed->add_subcommand("files", "Recorded depth images, as often as asked");
  files->footer(
      "What the folder may hold: roborun map build --help. The camera is the body: no mount.\n\n"
      "Example, in two terminals:\n"
      "  roborun feed files --from rgbd_dataset_freiburg1_xyz --intrinsics 517.3,516.5,318.6,255.3 "
      "--depth-scale 5000 --port front --odometry vio\n"
      "  roborun port watch front\n\n"
      "Exit code: 0 all images were written, 2 bad input, 130 interrupted.");
  add_recording_arguments(*files, options->recording);
  files->add_option("--port", options->port, "of the images: NAME, or a file")->required();
  files->add_option("--odometry", options->odometry, "the poses, too: NAME, or a file");
  add_number(*files, "--rate", options->rate_Hz, 0.1, 200.0, "images per second");
  files->add_flag("--loop", options->loop, "from the beginning again, until it is interrupted");
  files->callback([options, &run] { run = [options] { return feed_files(*options); }; });
}

}  // namespace roborun::app
