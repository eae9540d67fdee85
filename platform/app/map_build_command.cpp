#include "platform/app/map_build_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "core/sensor_model.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/recording_arguments.hpp"
#include "platform/dataset/map_build.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/input/text_file.hpp"
#include "platform/report/progress_line.hpp"

namespace roborun::app {
namespace {

struct BuildOptions {
  RecordingArguments recording;
  std::string model{"d455"}, output;
  double precision_m{0.3};
  bool json{false};
};

dataset::RecordingOptions build_options(const BuildOptions& options) {
  dataset::RecordingOptions recording = recording_options(options.recording);
  const auto model = model_of<CameraModel>(options.model);
  if (!model)
    throw InputError(
        fmt::format("--model: '{}': must be one of {}", options.model, fmt::join(kCameraModels, ", ")));
  recording.error = depth_error(*model);
  // Where the poses say is where the camera was: what is wrong with them is not known.
  recording.error.place_m = recording.error.angle_rad = 0.0;
  return recording;
}

void tell(const BuildOptions& options, const dataset::MapBuild& build) {
  const std::array<double, 3> ratio{build.agreement.false_free_ratio(),
                                    build.agreement.false_occupied_ratio(), build.agreement.missed_ratio()};
  if (options.json) {
    nlohmann::ordered_json json = {{"frames", build.frames},
                                   {"ms_median", build.ms_median},
                                   {"ms_p99", build.ms_p99},
                                   {"bytes", build.bytes}};
    constexpr std::array<const char*, 3> kKeys{"false_free_ratio", "false_occupied_ratio", "missed_ratio"};
    for (std::size_t i = 0; i < kKeys.size(); ++i) {
      if (std::isnan(ratio[i])) {
        json[kKeys[i]] = nullptr;
      } else {
        json[kKeys[i]] = ratio[i];
      }
    }
    fmt::print("{}\n", json.dump());
    return;
  }
  const auto percent = [](double r) {
    return std::isnan(r) ? std::string("-") : fmt::format("{:.2f} %", 100.0 * r);
  };
  fmt::print(
      "frames          {}\nper frame       {:.2f} ms median, {:.2f} ms p99\nmemory          {:.1f} MiB\n"
      "false free      {}\nfalse occupied  {}\nmissed          {}\n",
      build.frames, build.ms_median, build.ms_p99, static_cast<double>(build.bytes) / 1048576.0,
      percent(ratio[0]), percent(ratio[1]), percent(ratio[2]));
  if (!options.output.empty()) fmt::print("map             {}\n", options.output);
}

int build(const BuildOptions& options) {
  const dataset::RecordingOptions how = build_options(options);
  const bool full = !options.output.empty() && sitl::is_full_octomap(options.output);
  dataset::Recording recording(options.recording.from, how);
  input::check_outputs({{"--output", options.output}}, {});
  const input::StopOnSignal stop;
  dataset::MapBuild made;
  std::size_t done = 0;
  {
    report::ProgressLine line;
    made =
        dataset::build_map(recording, options.precision_m, !options.output.empty(), [&](std::size_t frames) {
          done = frames;
          if (line.due())
            line.show(fmt::format("{} of {} frames, {:.0f} s", frames, recording.size(), line.elapsed_s()));
          return !input::StopOnSignal::requested();
        });
  }
  if (input::StopOnSignal::requested())
    throw input::Interrupted(
        fmt::format("map build after {} of {} frames; no file was written", done, recording.size()));
  if (recording.left_out() > 0)
    fmt::print(stderr, "roborun: {} images were left out: no pose at their times\n", recording.left_out());
  if (made.frames_refused > 0)
    fmt::print(stderr, "roborun: {} frames were not believed by the map\n", made.frames_refused);
  if (made.bricks_given_up > 0)
    fmt::print(stderr, "roborun: the map was full: {} blocks of 16^3 cells were forgotten\n",
               made.bricks_given_up);
  if (!options.output.empty()) {
    if (made.leaves.leaves.empty())
      throw InputError(fmt::format("{}: nothing is known: no map to be written", options.recording.from));
    input::write_file(options.output, sitl::write_octomap(made.leaves, full));
  }
  tell(options, made);
  return kDone;
}

}  // namespace

void add_map_build_command(CLI::App& map, std::function<int()>& run) {
  const auto options = std::make_shared<BuildOptions>();
  CLI::App* command = map.add_subcommand("build", "make it from recorded depth images or clouds with poses");
  command->footer(
      "What DIR may hold:\n"
      "  depth.txt (lines \"time file\") and groundtruth.txt: TUM RGB-D; the pose at an image's time is that "
      "of a line within\n"
      "      1 ms, or between two lines at most 0.1 s apart; images without are left out and counted\n"
      "  NNN.png or depth/NNN.png, and poses.txt: a line for each image, in the order of the last number in "
      "its name\n"
      "  NNN.pcd or NNN.las, and poses.txt: the same for clouds, points in the sensor's frame (its pose: x, "
      "y, z as theirs)\n"
      "A pose: \"time tx ty tz qx qy qz qw\", or the 12 or 16 numbers of a matrix row by row; from the "
      "sensor to the world, z up.\n"
      "Images: PNG, grey, 16 bits; depth along the optical axis, 0: none; cameras look along z, x right, y "
      "down, undistorted.\n"
      "  Optics: camera.txt, \"fx fy cx cy per_m\", or --intrinsics and --depth-scale. What is not as far "
      "from the principal point on both\n"
      "  sides is cut off.\n"
      "Clouds become six images each, whose pixels are as fine as three quarters of them have points.\n\n"
      "What is printed:\n"
      "  frames                frames in the map\n"
      "  ms_median, ms_p99     processor time of one thread per frame; reading the file is not in it\n"
      "  bytes                 what the known space needs at the end\n"
      "The other three compare the map before a frame is added with that frame (200 frames at most, evenly "
      "spread; null: one frame):\n"
      "  false_free_ratio      surface pixels (a depth within the range) that end in a cell held free, of "
      "all surface pixels\n"
      "  missed_ratio          surface pixels that end in a cell held free or unknown, of all surface "
      "pixels\n"
      "  false_occupied_ratio  occupied cells that the image sees past with all pixels that meet them, by 3 "
      "sigma, of those\n"
      "                        that it sees past or shows\n\n"
      "Examples:\n"
      "  roborun map build --from rgbd_dataset_freiburg1_xyz --intrinsics 517.3,516.5,318.6,255.3 "
      "--depth-scale 5000 --range 4 -o desk.bt\n"
      "  roborun map build --from street --range 60 --json\n\n"
      "Exit code: 0 done, 2 bad input, 130 interrupted.");
  add_recording_arguments(*command, options->recording);
  add_number(*command, "--precision", options->precision_m, 0.05, 0.3, "edge of the finest cells, metres");
  command
      ->add_option("--model", options->model,
                   fmt::format("whose errors the images have: {}", fmt::join(kCameraModels, ", ")))
      ->capture_default_str();
  command->add_option("-o,--output", options->output, "write the map: a .bt or .ot file");
  command->add_flag("--json", options->json, "one line of JSON");
  command->callback([options, &run] { run = [options] { return build(*options); }; });
}

}  // namespace roborun::app
