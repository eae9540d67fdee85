#include "stages/planning/shorten.hpp"

#include <array>

namespace roborun::stages {
namespace {

constexpr double kGain_m = 1e-4;  // less is not worth a check

/// A point of the path and the piece it lies on.
struct Place {
  Vector3 p_W = Vector3::Zero();
  std::size_t piece{};
};

Place place_at(const Path& path_W, double at_m) noexcept {
  for (std::size_t i = 0; i + 1 < path_W.size(); ++i) {
    const double piece_m = (path_W[i + 1] - path_W[i]).norm();
    if (at_m <= piece_m || i + 2 == path_W.size())
      return {path_W[i] + (path_W[i + 1] - path_W[i]) * std::min(at_m / piece_m, 1.0), i};
    at_m -= piece_m;
  }
  return {path_W[0], 0};
}

/// Replaces the way between the two places, on different pieces, by a straight one.
bool cut(const MapView& view, double radius_m, const Place& from, const Place& to, Path& path_W,
         std::uint64_t& lookups) noexcept {
  double before_m = (path_W[from.piece + 1] - from.p_W).norm() + (to.p_W - path_W[to.piece]).norm();
  for (std::size_t i = from.piece + 1; i < to.piece; ++i) before_m += (path_W[i + 1] - path_W[i]).norm();
  if ((to.p_W - from.p_W).norm() > before_m - kGain_m) return false;
  const bool keep_from = from.p_W != path_W[from.piece];
  const bool keep_to = to.p_W != path_W[to.piece + 1];
  if (from.piece + 1 + (keep_from ? 1U : 0U) + (keep_to ? 1U : 0U) + path_W.size() - to.piece - 1 >
      Path::capacity())
    return false;
  if (!is_segment_free(view, from.p_W, to.p_W, radius_m, lookups)) return false;
  // Parts of a free piece are checked again: their samples lie elsewhere.
  if (keep_from && !is_segment_free(view, path_W[from.piece], from.p_W, radius_m, lookups)) return false;
  if (keep_to && !is_segment_free(view, to.p_W, path_W[to.piece + 1], radius_m, lookups)) return false;
  Path shorter;
  for (std::size_t i = 0; i <= from.piece; ++i) (void)shorter.push_back(path_W[i]);
  if (keep_from) (void)shorter.push_back(from.p_W);
  if (keep_to) (void)shorter.push_back(to.p_W);
  for (std::size_t i = to.piece + 1; i < path_W.size(); ++i) (void)shorter.push_back(path_W[i]);
  path_W = shorter;
  return true;
}

/// Drops each inner way-point that is not needed, or moves it towards the line between its neighbours by a
/// random share of the way.
void pull(const MapView& view, double radius_m, core::CounterRng& rng, Path& path_W,
          std::uint64_t& lookups) noexcept {
  Path tight;
  (void)tight.push_back(path_W[0]);
  for (std::size_t i = 1; i + 1 < path_W.size(); ++i) {
    const Vector3 a_W = tight.back();
    const Vector3 b_W = path_W[i + 1];
    const Vector3 way = b_W - a_W;
    const double length2 = way.squaredNorm();
    const double share = std::fmax(1.0 - rng.uniform(), 0.02) * (rng.uniform() < 0.5 ? 1.0 : 0.1);
    if (is_segment_free(view, a_W, b_W, radius_m, lookups)) continue;
    const Vector3 p_W = path_W[i];
    const double along = length2 > 0.0 ? (p_W - a_W).dot(way) / length2 : 0.0;
    const Vector3 on_line = a_W + std::fmin(std::fmax(along, 0.0), 1.0) * way;
    const Vector3 moved_W = p_W + share * (on_line - p_W);
    const double gain_m =
        (p_W - a_W).norm() + (b_W - p_W).norm() - (moved_W - a_W).norm() - (b_W - moved_W).norm();
    const bool better = gain_m > kGain_m && is_segment_free(view, a_W, moved_W, radius_m, lookups) &&
                        is_segment_free(view, moved_W, b_W, radius_m, lookups);
    (void)tight.push_back(better ? moved_W : p_W);
  }
  (void)tight.push_back(path_W.back());
  path_W = tight;
}

}  // namespace

double length_m(const Path& path_W) noexcept {
  double sum_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_W.size(); ++i) sum_m += (path_W[i + 1] - path_W[i]).norm();
  return sum_m;
}

double shorten(const MapView& view, double radius_m, double reach_m, int tries, core::CounterRng& rng,
               Path& path_W, std::uint64_t& lookups) noexcept {
  for (int i = 0; i < tries && path_W.size() > 2; ++i) {
    const double total_m = length_m(path_W);
    const double from_m = rng.uniform() * total_m;
    const double to_m = std::fmin(from_m + rng.uniform() * reach_m, total_m);
    const Place from = place_at(path_W, from_m);
    const Place to = place_at(path_W, to_m);
    if (from.piece < to.piece) (void)cut(view, radius_m, from, to, path_W, lookups);
  }
  if (path_W.size() > 2) pull(view, radius_m, rng, path_W, lookups);
  return length_m(path_W);
}

}  // namespace roborun::stages
