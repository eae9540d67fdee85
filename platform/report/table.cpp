#include "platform/report/table.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace roborun::report {

std::string comparison_table(std::span<const MissionResult> results) {
  const auto baseline = std::find_if(results.begin(), results.end(), [](const MissionResult& r) {
    return r.design == "static" && r.reached_goal;
  });
  const bool ratios = baseline != results.end() && results.size() > 1;
  std::string text =
      fmt::format("{:<12} {:>15} {:>8} {:>8} {:>9} {:>8} {:>13} {:>9} {:>15} {:>6}", "design", "result",
                  "time s", "dist m", "mean m/s", "kJ", "J/m", "decisions", "latency s", "late");
  if (ratios) text += fmt::format("  {}", "against static");
  text += '\n';
  text += fmt::format("{:<12} {:>15} {:>8} {:>8} {:>9} {:>8} {:>13} {:>9} {:>15} {:>6}\n", "", "", "", "", "",
                      "", "flight + comp", "", "median / max", "");
  for (const MissionResult& r : results) {
    text +=
        fmt::format("{:<12} {:>15} {:>8.1f} {:>8.1f} {:>9.2f} {:>8.1f} {:>13} {:>9} {:>15} {:>6}", r.design,
                    r.reason, r.mission_time_s, r.distance_m, r.mean_velocity_mps, r.energy_kJ,
                    fmt::format("{:.1f} + {:.1f}", r.flight_Jpm, r.computing_Jpm), r.decisions,
                    fmt::format("{:.2f} / {:.2f}", r.latency_s.median, r.latency_s.max), r.deadline_misses);
    if (ratios && &r != &*baseline && r.reached_goal) {
      text += fmt::format("  {:.1f}x v, {:.2f}x kJ", r.mean_velocity_mps / baseline->mean_velocity_mps,
                          r.energy_kJ / baseline->energy_kJ);
    }
    text += '\n';
  }
  return text;
}

}  // namespace roborun::report
