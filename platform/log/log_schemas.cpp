#include "platform/log/log_schemas.hpp"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>

#include "core/executive/stage_budget.hpp"

namespace roborun::log {
namespace {

constexpr std::string_view kTime =
    R"({"type":"object","title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}})";
constexpr std::string_view kVector =
    R"({"title":"foxglove.Vector3","type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}})";
constexpr std::string_view kQuaternion =
    R"({"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}})";
constexpr std::string_view kText = R"({"type":"string"})";
constexpr std::string_view kCount = R"({"type":"integer","minimum":0})";

using Property = std::pair<std::string_view, std::string>;

std::string joined(std::initializer_list<Property> properties) {
  std::string text;
  for (const auto& [name, type] : properties)
    text += fmt::format(R"({}"{}":{})", text.empty() ? "" : ",", name, type);
  return text;
}

std::string pose_type() {
  return object_schema("foxglove.Pose", joined({{"position", std::string(kVector)},
                                                {"orientation", std::string(kQuaternion)}}));
}

std::string array_of(const std::string& items) {
  return fmt::format(R"({{"type":"array","items":{}}})", items);
}

/// Names with blanks between, as properties that are all of one type.
std::string all_of(std::string_view names, std::string_view type) {
  std::string text;
  while (!names.empty()) {
    const std::size_t end = std::min(names.find(' '), names.size());
    text += fmt::format(R"({}"{}":{{"type":"{}"}})", text.empty() ? "" : ",", names.substr(0, end), type);
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  return text;
}

}  // namespace

std::string object_schema(const std::string& title, const std::string& properties) {
  return fmt::format(R"({{"title":"{}","type":"object","properties":{{{}}}}})", title, properties);
}

std::string pose_schema() {
  return object_schema(
      "foxglove.PoseInFrame",
      joined({{"timestamp", std::string(kTime)}, {"frame_id", std::string(kText)}, {"pose", pose_type()}}));
}

std::string poses_schema() {
  return object_schema("foxglove.PosesInFrame", joined({{"timestamp", std::string(kTime)},
                                                        {"frame_id", std::string(kText)},
                                                        {"poses", array_of(pose_type())}}));
}

std::string transforms_schema() {
  const std::string one =
      object_schema("foxglove.FrameTransform", joined({{"timestamp", std::string(kTime)},
                                                       {"parent_frame_id", std::string(kText)},
                                                       {"child_frame_id", std::string(kText)},
                                                       {"translation", std::string(kVector)},
                                                       {"rotation", std::string(kQuaternion)}}));
  return object_schema("foxglove.FrameTransforms", joined({{"transforms", array_of(one)}}));
}

std::string grid_schema() {
  const std::string field = object_schema(
      "foxglove.PackedElementField",
      joined(
          {{"name", std::string(kText)},
           {"offset", std::string(kCount)},
           {"type", R"({"title":"foxglove.NumericType","oneOf":[{"title":"UNKNOWN","const":0},)"
                    R"({"title":"UINT8","const":1},{"title":"INT8","const":2},{"title":"UINT16","const":3},)"
                    R"({"title":"INT16","const":4},{"title":"UINT32","const":5},{"title":"INT32","const":6},)"
                    R"({"title":"FLOAT32","const":7},{"title":"FLOAT64","const":8}]})"}}));
  return object_schema("foxglove.Grid",
                       joined({{"timestamp", std::string(kTime)},
                               {"frame_id", std::string(kText)},
                               {"pose", pose_type()},
                               {"column_count", std::string(kCount)},
                               {"cell_size", object_schema("foxglove.Vector2", all_of("x y", "number"))},
                               {"row_stride", std::string(kCount)},
                               {"cell_stride", std::string(kCount)},
                               {"fields", array_of(field)},
                               {"data", R"({"type":"string","contentEncoding":"base64"})"}}));
}

std::string text_schema() {
  return object_schema(
      "foxglove.Log",
      joined(
          {{"timestamp", std::string(kTime)},
           {"level",
            R"({"title":"foxglove.LogLevel","oneOf":[{"title":"UNKNOWN","const":0},{"title":"DEBUG","const":1},)"
            R"({"title":"INFO","const":2},{"title":"WARNING","const":3},{"title":"ERROR","const":4},)"
            R"({"title":"FATAL","const":5}]})"},
           {"message", std::string(kText)},
           {"name", std::string(kText)},
           {"file", std::string(kText)},
           {"line", std::string(kCount)}}));
}

std::string state_schema() {
  return object_schema(
      "roborun.State",
      all_of(
          "time_s x_m y_m z_m vx_mps vy_mps vz_mps speed_mps qw qx qy qz yaw_rad wx_radps wy_radps wz_radps "
          "ref_x_m ref_y_m ref_z_m ref_vx_mps ref_vy_mps ref_vz_mps ref_ax_mps2 ref_ay_mps2 ref_az_mps2 "
          "error_m "
          "position_sigma_m motor_1 motor_2 motor_3 motor_4 battery_ratio true_x_m true_y_m true_z_m",
          "number") +
          "," + all_of("phase action", "string"));
}

std::string decision_schema() {
  std::string numbers =
      "number time_s x_m y_m z_m goal_x_m goal_y_m goal_z_m speed_mps speed_limit_mps p0_m p1_m v0_m3 v1_m3 "
      "v2_m3 "
      "time_budget_s deadline_s latency_s visible_m closest_obstacle_m gap_average_m sensor_volume_m3 "
      "map_volume_m3 "
      "demand_m way_m";
  for (std::size_t i = 0; i < core::kStageCount; ++i)
    numbers += fmt::format(" {0}_s {0}_predicted_s", core::to_string(static_cast<core::StageId>(i)));
  return object_schema(
      "roborun.Decision",
      all_of(numbers, "number") + "," +
          all_of("kind budget_source speed_source solver active ways planner smoother refused", "string") +
          "," + joined({{"missed", R"({"type":"boolean"})"}, {"why", array_of(std::string(kText))}}));
}

std::string failsafe_schema() {
  return object_schema("roborun.Failsafe", all_of("time_s", "number") + "," +
                                               all_of("action phase sensor", "string") + "," +
                                               joined({{"conditions", array_of(std::string(kText))}}));
}

std::string dropped_schema() {
  return object_schema("roborun.Dropped", all_of("messages states decisions slices", "integer"));
}

}  // namespace roborun::log
