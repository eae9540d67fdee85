#include "platform/flight/camera_watch.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace roborun::flight {
namespace {

constexpr std::size_t kSide = 16;  // samples of a row, and of a column
constexpr double kReach_m = 10.0;
constexpr double kNear_m = 1.0;
constexpr double kBeside_m = 0.6;  // what an estimate of centimetres and cells of 0.3 m may be off by
constexpr double kSigmas = 3.0;
constexpr int kLeastSurfaces = 6;  // of a part that counts
constexpr int kLeastParts = 3;
// A quarter of the image: a body in front of the open sky is no measure of a mount.
constexpr int kLeastOfAll = 64;

struct Part {
  int surfaces{0}, contradictions{0};
};

}  // namespace

Agreement agreement_of(const stages::PosedDepthFrame& posed, const stages::MapView& known) noexcept {
  const firmware_if::DepthFrame& f = posed.frame;
  std::array<Part, 4> part{};
  std::uint64_t lookups = 0;
  for (std::size_t j = 0; j < kSide; ++j) {
    for (std::size_t i = 0; i < kSide; ++i) {
      const std::size_t u = (2 * i + 1) * f.width / (2 * kSide), v = (2 * j + 1) * f.height / (2 * kSide);
      const auto depth_m = static_cast<double>(f.depth_m[v * f.width + u]);
      const double nearest_m = std::max(kNear_m, static_cast<double>(f.range_min_m));
      if (!(depth_m > nearest_m && depth_m < std::min(kReach_m, static_cast<double>(f.range_m)))) continue;
      const Vector3 ray_C(
          1.0, (1.0 - (2.0 * static_cast<double>(u) + 1.0) / f.width) * static_cast<double>(f.tan_half_width),
          (1.0 - (2.0 * static_cast<double>(v) + 1.0) / f.height) * static_cast<double>(f.tan_half_height));
      const Vector3 p_W = posed.X_WC * Vector3(depth_m * ray_C);
      const double sigma_m =
          posed.error.at_m(depth_m) + posed.error.place_m + posed.error.angle_rad * depth_m;
      const double half_m = std::max(kBeside_m, kSigmas * sigma_m);
      Part& of = part[2 * (2 * j / kSide) + 2 * i / kSide];
      ++of.surfaces;
      if (known.is_free_at_finest(Aabb::around(p_W, half_m), lookups)) ++of.contradictions;
    }
  }
  Part all;
  int parts = 0;
  bool everywhere = true;
  for (const Part& p : part) {
    if (p.surfaces < kLeastSurfaces) continue;
    ++parts;
    all.surfaces += p.surfaces;
    all.contradictions += p.contradictions;
    everywhere = everywhere && 8 * p.contradictions >= p.surfaces;
  }
  if (parts < kLeastParts || all.surfaces < kLeastOfAll) return Agreement::kUnknown;
  return everywhere && 3 * all.contradictions >= all.surfaces ? Agreement::kDisagrees : Agreement::kAgrees;
}

}  // namespace roborun::flight
