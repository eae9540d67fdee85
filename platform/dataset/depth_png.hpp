/// Depth images in PNG files, read by libpng.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace roborun::dataset {

/// Row-major, [v * width + u].
struct DepthPng {
  std::size_t width{}, height{};
  std::vector<std::uint16_t> value;
};

/// A PNG file in memory: one channel of 16 bits, 8 to kMaxImageSide pixels a side. Throws InputError "NAME: WHAT: must be ..." for
/// anything else, and for a file that is damaged or cut off.
[[nodiscard]] DepthPng parse_depth_png(std::span<const unsigned char> bytes, const std::string& name);

}  // namespace roborun::dataset
