#include "platform/app/recording_arguments.hpp"

#include <fmt/format.h>

#include <vector>

#include "platform/app/options.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::app {

void add_recording_arguments(CLI::App& command, RecordingArguments& arguments) {
  command.add_option("--from", arguments.from, "a folder")->required();
  add_number(command, "--range", arguments.range_m, 0.5, 300.0, "what is farther is not looked at, metres");
  command.add_option("--intrinsics", arguments.intrinsics, "FX,FY,CX,CY in pixels, instead of camera.txt");
  command.add_option("--depth-scale", arguments.scale, "values of an image per metre, such as 1000 or 5000");
}

std::array<double, 4> intrinsics_of(const std::string& text) {
  const std::vector<std::string> part = input::split(text);
  if (part.size() != 4)
    throw InputError(fmt::format("--intrinsics: '{}': must be FX,FY,CX,CY in pixels", text));
  std::array<double, 4> optics{};
  for (std::size_t i = 0; i < 4; ++i) optics.at(i) = input::number_of("--intrinsics", part[i], 1.0, 10000.0);
  return optics;
}

dataset::RecordingOptions recording_options(const RecordingArguments& arguments) {
  dataset::RecordingOptions recording;
  recording.range_m = arguments.range_m;
  if (arguments.intrinsics.empty() != arguments.scale.empty())
    throw InputError("--intrinsics, --depth-scale: must be given both or none");
  if (arguments.intrinsics.empty()) return recording;
  const std::array<double, 4> optics = intrinsics_of(arguments.intrinsics);
  recording.optics = {optics[0], optics[1], optics[2], optics[3],
                      input::number_of("--depth-scale", arguments.scale, 1.0, 1e6)};
  return recording;
}

}  // namespace roborun::app
