#include "platform/live/mission_route.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

using ItemKind = mavlink::MissionItem::Kind;
constexpr double kFarAway_m = 16000.0;  // as core::Fence

class RouteMaker {
 public:
  explicit RouteMaker(const sensor_port::EarthPlace& origin) : origin_(origin), frame_(origin) {}

  [[nodiscard]] Vector3 place_of(const mavlink::EarthPoint& point, double height_m,
                                 const std::string& where) const {
    const auto p_m = frame_.to_local_m({point.latitude_deg, point.longitude_deg, origin_.height_m});
    Vector3 p_W(p_m[0], p_m[1], height_m);
    if (!(p_W.norm() < kFarAway_m))
      throw InputError(fmt::format("{}: {:.0f} m from where the world begins: must be within {:.0f} m", where,
                                   p_W.norm(), kFarAway_m));
    return p_W;
  }

  void add(const mavlink::MissionItem& item) {
    RouteStep step;
    step.where = item.where;
    switch (item.kind) {
      case ItemKind::kTakeOff:
        route_.cruise_m = at_W_.z() = item.height_m;
        return;
      case ItemKind::kWaypoint:
        step.goal_W = at_W_ = place_of(*item.place, item.height_m, item.where);
        step.hold_s = item.hold_s;
        break;
      case ItemKind::kHold:
        step.hold_s = item.hold_s;
        break;
      case ItemKind::kSpeed:
        step.speed_mps = item.speed_mps;
        break;
      case ItemKind::kRelease:
        step.releases = true;
        break;
      case ItemKind::kReturn:
        step.goal_W = Vector3(0.0, 0.0, std::max(route_.cruise_m, at_W_.z()));
        step.returns = true;
        break;
      case ItemKind::kLand:
        if (!item.place) return;
        step.goal_W = place_of(*item.place, at_W_.z(), item.where);
        break;
    }
    goes_ = goes_ || step.goal_W.has_value();
    if (!goes_ && !step.speed_mps)
      throw InputError(fmt::format("{}: delay, gripper: must come after a way-point", item.where));
    if (step.goal_W && route_.cruise_m == 0.0) route_.cruise_m = step.goal_W->z();
    route_.steps.push_back(std::move(step));
  }

  void add(const mavlink::MissionArea& area) {
    const auto side = area.keep_in ? core::FenceSide::kKeepIn : core::FenceSide::kKeepOut;
    std::vector<core::FencePoint> points;
    for (const mavlink::EarthPoint& point : area.points) {
      const Vector3 p_W = place_of(point, 0.0, area.where);
      points.push_back({p_W.x(), p_W.y()});
    }
    const core::FenceFault fault = area.radius_m > 0.0
                                       ? route_.fence.add_circle(side, points.front(), area.radius_m)
                                       : route_.fence.add_polygon(side, points);
    if (fault != core::FenceFault::kNone)
      throw InputError(fmt::format("{}: {}", area.where, core::to_string(fault)));
  }

  [[nodiscard]] Route take() { return std::move(route_); }

 private:
  sensor_port::EarthPlace origin_;
  sensor_port::LocalFrame frame_;
  Route route_;
  bool goes_{false};                ///< Some step has a goal.
  Vector3 at_W_ = Vector3::Zero();  ///< Of the last item with a place.
};

}  // namespace

Route route_of(const mavlink::MissionFile& file, const sensor_port::EarthPlace& origin) {
  RouteMaker maker(origin);
  for (const mavlink::MissionItem& item : file.items) maker.add(item);
  for (const mavlink::MissionArea& area : file.fence) maker.add(area);
  return maker.take();
}

}  // namespace roborun::live
