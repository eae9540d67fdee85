/// Vehicle, sensors and wind of a simulated mission from a TOML file.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "platform/input/toml_reader.hpp"
#include "platform/mission/mission.hpp"

namespace roborun::mission {

/// Tables [camera] pixels, range_m, rate_Hz, latency_s, noise_m, noise_per_m, pixel_dropout_ratio,
/// frame_dropout_ratio; [wind] mean_mps = [x, y, z], gust_mps; [battery] capacity_J; [flight] v_max_mps,
/// time_limit_s; [cpu] slow_down_at_s, slow_down_factor; [fog] visibility_m; [fence] altitude_m = [low,
/// high], keep_in and keep_out, arrays of { polygon = [[x, y], ...] } or { circle = [x, y, radius] }. What is
/// not there keeps its default. Throws InputError with file, line, key and range.
void load_settings(const std::string& path, MissionConfig& config);

/// The same from a file that holds other tables too.
inline const std::set<std::string_view> kSettingsTables{"camera", "wind", "battery", "flight",
                                                        "cpu",    "fog",  "fence"};
void read_settings(const input::TomlReader& reader, const toml::table& root, MissionConfig& config);

}  // namespace roborun::mission
