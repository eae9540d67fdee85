/// A mission as a picture: the world from above, the path of every design, and what it spent on the way.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/vector.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::report {

/// The world as the picture needs it, metres.
struct Scene {
  struct Circle {
    double x_m, y_m, radius_m;
  };
  struct Rect {
    double x_m, y_m, width_m, height_m;
  };
  std::string title;
  const char* background{"#f7f9fb"};
  Aabb bounds_W{};
  Vector3 start_W = Vector3::Zero();
  Vector3 goal_W = Vector3::Zero();
  std::vector<Circle> circles;
  std::vector<Rect> rects;
  std::vector<std::vector<std::array<double, 2>>>
      outlines;  ///< Of other shapes: (x, y) of the corners, in turn.
  /// Zones A | B | C: where the congested ends stop, x of the two dashed lines; empty if the world has no
  /// zones.
  std::vector<double> zone_borders_m;
  /// Heat map: ratio 0 .. 1 of cell (i, k) at [k * columns + i], from bounds_W.min_W, square cells.
  double heat_cell_m{10.0};
  int heat_columns{};
  int heat_rows{};
  std::vector<double> heat_ratio;
};

enum class PathColour { kSpeed, kPrecision, kVolume, kLatency, kVisibility, kDeadline };
inline constexpr std::array<const char*, 6> kPathColourName{"speed",   "precision",  "volume",
                                                            "latency", "visibility", "deadline"};

/// A complete SVG file without external resources. One panel a mission, true to scale, the path coloured by
/// one quantity with a legend; below it speed, latency and precision over the way of all missions.
[[nodiscard]] std::string mission_svg(const Scene& scene, std::span<const MissionReport> missions,
                                      PathColour colour);

/// A row for each quantity of PathColour, a column for each mission: the maps by which RoboRun shows what its
/// two designs do in a high-precision and in a high-velocity mission. A complete SVG file.
[[nodiscard]] std::string maps_svg(const Scene& scene, std::span<const MissionReport> missions);

}  // namespace roborun::report
