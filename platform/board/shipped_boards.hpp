/// The board files of platform/sitl/boards, as text in the program: CMake writes the source.
#pragma once

namespace roborun::board {

extern const char* const kCortexA72;       ///< Own map and planner.
extern const char* const kCortexA72Stock;  ///< octomap and ompl:RRTstar.

}  // namespace roborun::board
