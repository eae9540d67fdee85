/// Where bodies that move near the vehicle will be: constant velocity, with bounds that grow.
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "core/depth_error.hpp"
#include "core/geometry/vector.hpp"
#include "core/trajectory.hpp"
#include "firmware_if/time.hpp"
#include "stages/perception/point_cloud.hpp"

namespace roborun::flight {

/// A track is begun by a place where something appeared in free space, and counts once the same body was seen often enough
/// and has moved: what is discovered late does not move on. RT-safe: O(tracks), no allocation.
class BodyTracks {
 public:
  static constexpr std::size_t kMost = 12;
  static constexpr double kHorizon_s = 4.0;  ///< Farther ahead a constant velocity says little.
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// Places of one decision where surfaces were seen in space known to be free, at this instant. Beyond `kMost` places the
  /// one that was not seen for longest is forgotten, bodies that move last.
  /// `error` is of the depths.
  void observe(MonotonicTime now, const Vector3& p_WB, std::span<const Vector3> places_W,
               const DepthError& error) noexcept;
  /// After observe(), with all surfaces of this decision: what appeared not long ago, or is known to move, is looked for
  /// where it should be now. What is slow stays for long in cells that are not free, and appears once. O(tracks x points).
  void follow(MonotonicTime now, const Vector3& p_WB, std::span<const stages::CloudPoint> points) noexcept;
  /// Bodies whose motion is known at this instant.
  [[nodiscard]] std::size_t count(MonotonicTime now) const noexcept;
  /// One of them is nearer than this, and not behind what flies here at this velocity.
  [[nodiscard]] bool near(MonotonicTime now, const Vector3& p_WB, const Vector3& v_WB,
                          double reach_m) const noexcept;
  struct Meeting {
    double near_s{kNever};   ///< When it first comes nearer to a body than both bounds allow.
    double touch_s{kNever};  ///< When both would touch, without bounds.
    double own_mps{};        ///< Its own speed towards the body then.
    /// What is better is more: +infinity if it keeps off; then what does not touch, what stands when it is touched, what
    /// is touched later.
    [[nodiscard]] double score() const noexcept;
  };
  /// How what flies this trajectory meets bodies, in seconds after `from`, while they approach each other, within the
  /// horizon. The rest after the trajectory's end counts, too. Heights apart by more than a body may be high do not meet.
  /// What touches at `from` already is met at the second look (0.1 s) if it comes nearer still, and not met if they part: whatever
  /// leads out of a touch is as good as keeping off.
  /// `radius_m` is planned with, `body_m` is the vehicle's own.
  [[nodiscard]] Meeting meets(const Trajectory& trajectory, MonotonicTime from, double radius_m,
                              double body_m) const noexcept;

 private:
  struct Track {
    Vector3 p_W = Vector3::Zero();
    Vector3 v_W = Vector3::Zero();
    MonotonicTime seen{};
    MonotonicTime moved = MonotonicTime::min();  ///< When it was last seen to move.
    Vector3 first_W = Vector3::Zero();           ///< Where it was seen first.
    double least_m{};                            ///< What is not as far from there may be noise: level.
    Vector3 behind_W = Vector3::Zero();          ///< From what was seen of it to its middle.
    int sightings{0};
  };
  /// It was seen here now.
  static void see(Track& track, const Vector3& place_W, const Vector3& p_WB, MonotonicTime now) noexcept;
  /// Where it is at this instant.
  [[nodiscard]] static Vector3 at_W(const Track& track, MonotonicTime time) noexcept {
    return track.p_W + seconds(time - track.seen) * track.v_W;
  }
  [[nodiscard]] static bool is_sure(const Track& track, MonotonicTime now) noexcept;
  /// It is looked for on its surface: new, or sure not long ago, though one estimate may say that it stands.
  [[nodiscard]] static bool is_followed(const Track& track, MonotonicTime now) noexcept;
  /// The track that this place continues, or null.
  [[nodiscard]] Track* continued_by(const Vector3& place_W, MonotonicTime now) noexcept;
  void begin(const Vector3& place_W, const Vector3& p_WB, MonotonicTime now,
             const DepthError& error) noexcept;

  std::array<Track, kMost> track_{};
};

}  // namespace roborun::flight
