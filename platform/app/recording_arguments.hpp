/// The options of every command that takes a recording.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <string>

#include "platform/dataset/recording.hpp"

namespace roborun::app {

struct RecordingArguments {
  std::string from, intrinsics, scale;
  double range_m{10.0};
};

/// Adds --from, --range, --intrinsics and --depth-scale. `arguments` must outlive the command.
void add_recording_arguments(CLI::App& command, RecordingArguments& arguments);
/// FX,FY,CX,CY in pixels. Throws InputError that names --intrinsics.
[[nodiscard]] std::array<double, 4> intrinsics_of(const std::string& text);
/// Throws InputError that names the option.
[[nodiscard]] dataset::RecordingOptions recording_options(const RecordingArguments& arguments);

}  // namespace roborun::app
