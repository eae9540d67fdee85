#include "stages/perception/scan_history.hpp"

#include <algorithm>
#include <cmath>

namespace roborun::stages {
namespace {

// Tiles. Of a camera of 90 degrees one is as wide as a body of 0.3 m at 24 m.
constexpr std::size_t kSide = 160;
constexpr int kMostShift = 3;
static_assert(kMaxImageSide <= kSide << kMostShift);
// Cubes of level 1: of those of the finest level only the inner half would count.
constexpr PrecisionLattice kCubes{.finest_m = 0.5 * ScanHistory::kCube_m};

std::size_t most_tiles(std::size_t pixels) noexcept { return std::min(pixels, kSide); }

}  // namespace

std::size_t ScanHistory::arena_bytes(std::size_t frames, std::size_t max_width,
                                     std::size_t max_height) noexcept {
  return 2 * frames * DepthPyramid::arena_bytes(most_tiles(max_width), most_tiles(max_height));
}

ScanHistory::ScanHistory(core::Arena& arena, std::size_t frames, std::size_t max_width,
                         std::size_t max_height) noexcept {
  for (Scan& scan : scan_) {
    scan.cameras.lattice = kCubes;
    for (std::size_t i = 0; i < frames; ++i)
      scan.pyramid[i].emplace(arena, most_tiles(max_width), most_tiles(max_height), "map earlier image");
  }
}

bool ScanHistory::begin(MonotonicTime stamp) noexcept {
  const Scan& last = scan_[last_];
  if (last.cameras.count > 0 && stamp >= last.stamp && stamp - last.stamp < kApart) return false;
  if (last.cameras.count > 0) last_ = 1 - last_;
  scan_[last_].stamp = stamp;
  scan_[last_].cameras.count = 0;
  return true;
}

void ScanHistory::add(const PosedDepthFrame& posed, const firmware_if::DepthFrame& frame) noexcept {
  Scan& scan = scan_[last_];
  if (scan.cameras.count == kMaxCameras || !scan.pyramid[scan.cameras.count]) return;
  DepthPyramid& image = *scan.pyramid[scan.cameras.count];
  int shift = 0;
  while (shift < kMostShift && std::max(frame.width, frame.height) > kSide << static_cast<unsigned>(shift))
    ++shift;
  if (image.build(frame, shift) != Status::kOk) return;
  SightCamera& camera = scan.cameras.camera[scan.cameras.count++];
  camera.prepare(posed, image);
  camera.widening += 0.5F / std::fmin(camera.columns_per_tan, camera.rows_per_tan);
}

void ScanHistory::forget() noexcept {
  for (Scan& scan : scan_) scan.cameras.count = 0;
}

std::uint64_t ScanHistory::saw_through(MonotonicTime now, std::span<const Vector3> center_W) const noexcept {
  if (center_W.empty()) return 0;
  std::uint64_t through = 0;
  for (const Scan& scan : scan_) {
    const Nanos age = now - scan.stamp;
    if (scan.cameras.count == 0 || age < kYoungest || age > kOldest) continue;
    through |= see_blocks(scan.cameras, 1, center_W).free;
  }
  return through & (~std::uint64_t{0} >> (BlocksSeen::kMost - std::min(center_W.size(), BlocksSeen::kMost)));
}

}  // namespace roborun::stages
