/// Missions as ground stations write them: QGroundControl's .plan (JSON, version 1) and .waypoints ("QGC WPL 110").
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace roborun::mavlink {

/// WGS 84.
struct EarthPoint {
  double latitude_deg{}, longitude_deg{};
};

/// What is flown, one after the other. What an item leaves open (yaw, radius of acceptance) is ours to choose.
struct MissionItem {
  enum class Kind : std::uint8_t {
    kTakeOff,   ///< Straight up to the height. The first one, or none.
    kWaypoint,  ///< There, to a stop, and so many seconds of hold.
    kHold,      ///< So many seconds where it is.
    kSpeed,     ///< At most so fast from here on.
    kRelease,   ///< Of the package, in hover.
    kLand,      ///< There, or where it is. The last one, or none.
    kReturn,    ///< To where it took off, and down. Likewise.
  };
  Kind kind{};
  std::string where;  ///< "line 4", "item 3": for complaints.
  std::optional<EarthPoint> place{};
  double height_m{};  ///< Over home.
  double hold_s{};
  double speed_mps{};
};

struct MissionArea {
  bool keep_in{};
  double radius_m{0.0};  ///< Above 0: a circle around the only point.
  std::vector<EarthPoint> points;
  std::string where;
};

struct MissionFile {
  EarthPoint home{};  ///< Where the plan begins.
  double home_height_m{};
  std::vector<MissionItem> items;
  std::vector<MissionArea> fence;  ///< Of .plan files alone.
};

/// Commands of MAVLink that it knows: 16 way-point (without a spline), 19 loiter time, 20 return, 21 land, 22 take-off, 93 delay (not until
/// a time of day), 178 change of speed, 211 gripper (release). Heights over home or over the sea (frames 3, 6, 0, 5).
/// Throws InputError "PATH: line 4: ..." or "PATH: item 3: ..." for whatever else, and for numbers that make no sense.
[[nodiscard]] MissionFile load_mission(const std::string& path);

}  // namespace roborun::mavlink
