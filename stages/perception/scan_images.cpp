#include "stages/perception/scan_images.hpp"

#include <algorithm>
#include <utility>

namespace roborun::stages {
namespace {

constexpr PrecisionLattice kCubes{.finest_m =
                                      0.5 * ScanHistory::kCube_m};  // of level 1: all of the cube counts

}  // namespace

ScanHistory::ScanHistory(core::Arena& arena, std::size_t frames, std::size_t max_width,
                         std::size_t max_height) noexcept {
  for (ScanImages& scan : scan_)
    for (std::size_t i = 0; i < frames; ++i) scan.pyramid[i].emplace(arena, max_width, max_height);
}

ScanImages& ScanHistory::begin(MonotonicTime stamp) noexcept {
  // The last one is kept if it is old enough beside the one before: else what is compared with would never get old.
  const ScanImages &last = scan_[by_age_[0]], &before = scan_[by_age_[1]];
  if (last.cameras.count > 0 && (before.cameras.count == 0 || last.stamp - before.stamp >= kApart))
    std::rotate(by_age_.begin(), by_age_.end() - 1, by_age_.end());
  ScanImages& scan = scan_[by_age_[0]];
  scan.stamp = stamp;
  scan.cameras.count = 0;
  return scan;
}

void ScanHistory::forget() noexcept {
  for (ScanImages& scan : scan_) scan.cameras.count = 0;
}

std::uint64_t ScanHistory::saw_through(MonotonicTime now, std::span<const Vector3> center_W) const noexcept {
  if (center_W.empty()) return 0;
  std::uint64_t through = 0;
  for (const ScanImages& scan : scan_) {
    const Nanos age = now - scan.stamp;
    if (scan.cameras.count == 0 || age < kYoungest || age > kOldest) continue;
    SightCameras cameras = scan.cameras;
    cameras.lattice = kCubes;
    through |= see_blocks(cameras, 1, center_W).free;
  }
  return through & (~std::uint64_t{0} >> (BlocksSeen::kMost - std::min(center_W.size(), BlocksSeen::kMost)));
}

}  // namespace roborun::stages
