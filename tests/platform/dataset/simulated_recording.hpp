/// Recordings made by the simulator's camera: folders as public RGB-D sets have them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/sensor_rig.hpp"
#include "platform/sitl/world/world.hpp"

namespace roborun::test {

/// A room of 10 x 8 x 3 m with shelves, a table and two columns.
[[nodiscard]] sitl::World room();
/// 40 columns of 1 m, 12 m high, on a plane, within 30 m.
[[nodiscard]] sitl::World yard();

struct SimulatedRecording {
  std::uint16_t width{64}, height{48};
  double range_m{10.0};
  CameraModel model{CameraModel::kClean};
  int frames{20};
  double rate_Hz{30.0};
  double circle_m{1.5};  ///< The camera goes round on this circle at 0.5 m/s, looking ahead and outwards.
  double height_m{1.4};
  double per_m{5000.0};  ///< Values of an image per metre.
};

/// Writes depth.txt, groundtruth.txt, camera.txt and depth/*.png into a folder that it makes.
void write_recording(const std::string& folder, const sitl::World& world, const SimulatedRecording& how);

/// One channel of 8 or 16 bits; `value` has width * height numbers.
void write_png(const std::string& path, std::uint32_t width, std::uint32_t height, int bits,
               const std::vector<std::uint16_t>& value);

}  // namespace roborun::test
