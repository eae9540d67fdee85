/// The JSON schemas of a log's topics: Foxglove's own by their published names, fields and types
/// (https://github.com/foxglove/foxglove-sdk, schemas/jsonschema), and ours.
#pragma once

#include <string>

namespace roborun::log {

[[nodiscard]] std::string pose_schema();        ///< foxglove.PoseInFrame
[[nodiscard]] std::string poses_schema();       ///< foxglove.PosesInFrame
[[nodiscard]] std::string transforms_schema();  ///< foxglove.FrameTransforms
[[nodiscard]] std::string grid_schema();        ///< foxglove.Grid
[[nodiscard]] std::string text_schema();        ///< foxglove.Log
[[nodiscard]] std::string object_schema(const std::string& title, const std::string& properties = {});
[[nodiscard]] std::string state_schema();
[[nodiscard]] std::string decision_schema();
[[nodiscard]] std::string failsafe_schema();
[[nodiscard]] std::string dropped_schema();

}  // namespace roborun::log
