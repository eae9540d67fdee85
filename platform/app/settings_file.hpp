/// Vehicle, sensors and wind of a simulated mission from a TOML file.
#pragma once

#include <string>

#include "platform/app/mission.hpp"

namespace roborun::app {

/// Tables [camera] pixels, range_m, rate_Hz, latency_s, noise_m, noise_per_m, pixel_dropout_ratio,
/// frame_dropout_ratio; [wind] mean_mps = [x, y, z], gust_mps; [battery] capacity_J; [flight] v_max_mps,
/// time_limit_s; [cpu] slow_down_at_s, slow_down_factor. What is not there keeps its default. Throws
/// sitl::InputError with file, line, key and range.
void load_settings(const std::string& path, MissionConfig& config);

}  // namespace roborun::app
