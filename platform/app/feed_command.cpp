#include "platform/app/feed_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/port_command.hpp"
#include "platform/app/recording_arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/sensor_port/roborun_port.h"

namespace roborun::app {
namespace {

/// A port that this process writes.
class FedPort {
 public:
  FedPort(const std::string& name, std::uint32_t kind, std::size_t most_bytes) {
    constexpr std::uint32_t kSlots = 8;
    const std::string path = port_path(name);
    const char* wrong =
        roborun_port_open(&writer_, path.c_str(), kind, static_cast<std::uint32_t>(most_bytes), kSlots);
    if (wrong != nullptr) throw InputError(fmt::format("{}: {}", path, wrong));
  }
  ~FedPort() { roborun_port_close(&writer_); }
  FedPort(const FedPort&) = delete;
  FedPort& operator=(const FedPort&) = delete;
  template <typename Sample>
  void write(const Sample& sample, std::span<const float> payload = {}) {
    (void)roborun_port_write(&writer_, &sample, payload.data(),
                             static_cast<std::uint32_t>(payload.size_bytes()));
  }

 private:
  roborun_port_writer writer_{-1, 0, nullptr};
};

struct FeedFilesOptions {
  RecordingArguments recording;
  std::string port, odometry;
  double rate_Hz{10.0};
  bool loop{false};
};

roborun_port_depth depth_of(const firmware_if::DepthFrame& f, const roborun_port_stamp& at) {
  roborun_port_depth d{};
  d.at = at;
  d.width = f.width;
  d.height = f.height;
  d.pixel = ROBORUN_PORT_FLOAT32_M;
  d.fx = 0.5F * static_cast<float>(f.width) / f.tan_half_width;
  d.fy = 0.5F * static_cast<float>(f.height) / f.tan_half_height;
  d.cx = 0.5F * static_cast<float>(f.width) - 0.5F;
  d.cy = 0.5F * static_cast<float>(f.height) - 0.5F;
  d.range_min_m = f.range_min_m;
  d.range_m = f.range_m;
  d.mount.q_BS[0] = 1.0F;
  return d;
}

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
  FedPort images(options.port, ROBORUN_PORT_DEPTH, recording.load(0).front().frame.depth_m.size_bytes());
  std::unique_ptr<FedPort> odometry;
  if (!options.odometry.empty())
    odometry = std::make_unique<FedPort>(options.odometry, ROBORUN_PORT_ODOMETRY, 0);
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
    images.write(depth_of(posed.frame, at), posed.frame.depth_m);
    if (odometry) {
      roborun_port_odometry o = odometry_of(posed.X_WC, i == 0 ? posed.X_WC : before, step_s, at);
      o.reset_counter = round;  // from the last pose back to the first
      odometry->write(o);
    }
    before = posed.X_WC;
    if (line.due())
      line.show(fmt::format("{} of {} images, {:.0f} s", i + 1, recording.size(), line.elapsed_s()));
  }
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

}  // namespace

void add_feed_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* feed = app.add_subcommand("feed", "Feeders: processes that write to sensor ports (roborun port)");
  feed->require_subcommand(1);
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
  add_number(*files, "--rate", options->rate_Hz, 0.1, 200.0, "images a second");
  files->add_flag("--loop", options->loop, "from the beginning again, until it is interrupted");
  files->callback([options, &run] { run = [options] { return feed_files(*options); }; });
}

}  // namespace roborun::app
