/// The true world: what the cameras see and what the vehicle can hit. What moves in it is a function of time
/// alone.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/geometry/vector.hpp"
#include "firmware_if/time.hpp"
#include "platform/sitl/world/triangle_mesh.hpp"
#include "platform/sitl/world/voxel_grid.hpp"

namespace roborun::sitl {

/// A vertical cylinder.
struct Pillar {
  double x_m{};
  double y_m{};
  double radius_m{};
  double bottom_m{0.0};
  double top_m{20.0};
};

struct Ball {
  Vector3 center_W = Vector3::Zero();
  double radius_m{};
};

/// A box or a cylinder that stands in its own frame S, and S in any way in the world.
struct Turned {
  Pose X_WS;
  std::variant<Aabb, Pillar> shape_S;
};

/// A sphere, or an upright cylinder, that goes along its way-points at a constant speed and stays at the
/// last.
struct Body {
  double radius_m{};
  double height_m{0.0};  ///< Of the cylinder; 0: a sphere.
  double speed_mps{};
  double start_s{0.0};          ///< It waits at its first way-point until then, counted from time zero.
  std::vector<Vector3> path_W;  ///< Of its centre; at least one point.

  [[nodiscard]] Vector3 center_W(MonotonicTime when) const noexcept;
};

/// Everything a world is made of.
struct WorldDescription {
  Aabb bounds_W{};       ///< Where the vehicle's centre may be.
  double ground_m{0.0};  ///< Height of the plane that is the ground; -infinity: there is none.
  Vector3 start_W = Vector3::Zero();
  Vector3 goal_W = Vector3::Zero();
  std::vector<Pillar> pillars;
  std::vector<Aabb> boxes;
  std::vector<Ball> balls;
  std::vector<Turned> turned;
  TriangleMesh mesh;
  VoxelGrid voxels;
  std::vector<Body> bodies;
};

/// Box around all that does not move; empty (min above max) if there is nothing. The plane of the ground has no size.
[[nodiscard]] Aabb extent_W(const WorldDescription& world) noexcept;

class World {
 public:
  /// Builds the search grid. Throws InputError if start or goal is out of bounds, or bounds are empty or not
  /// finite, or larger than 20 km.
  explicit World(WorldDescription description);

  [[nodiscard]] const Aabb& bounds_W() const noexcept { return description_.bounds_W; }
  [[nodiscard]] const Vector3& start_W() const noexcept { return description_.start_W; }
  [[nodiscard]] const Vector3& goal_W() const noexcept { return description_.goal_W; }
  [[nodiscard]] const std::vector<Pillar>& pillars() const noexcept { return description_.pillars; }
  [[nodiscard]] const std::vector<Aabb>& boxes() const noexcept { return description_.boxes; }
  [[nodiscard]] const std::vector<Ball>& balls() const noexcept { return description_.balls; }
  [[nodiscard]] const std::vector<Turned>& turned() const noexcept { return description_.turned; }
  [[nodiscard]] const TriangleMesh& mesh() const noexcept { return description_.mesh; }
  [[nodiscard]] const VoxelGrid& voxels() const noexcept { return description_.voxels; }
  [[nodiscard]] const std::vector<Body>& bodies() const noexcept { return description_.bodies; }
  [[nodiscard]] double ground_m() const noexcept { return description_.ground_m; }
  /// What it was made of, back.
  [[nodiscard]] WorldDescription description() && noexcept { return std::move(description_); }
  void add(const std::vector<Body>& bodies);

  /// Distance along a unit direction to the first surface (obstacle or ground) of what does not move,
  /// +infinity if none within max_m.
  [[nodiscard]] double hit_distance_m(const Vector3& origin_W, const Vector3& direction_W,
                                      double max_m) const noexcept;
  /// The same with the bodies where they are at `when`.
  [[nodiscard]] double hit_distance_m(const Vector3& origin_W, const Vector3& direction_W, double max_m,
                                      MonotonicTime when) const noexcept;
  /// Distance from a point to the nearest obstacle that does not move (the plane of the ground is none), at most
  /// cap_m; 0 inside an obstacle.
  [[nodiscard]] double clearance_m(const Vector3& p_W, double cap_m) const noexcept;
  /// Height of the first surface or ground straight below the point, -infinity if there is none. A point inside of an
  /// obstacle is over that obstacle's own surface: its own height.
  [[nodiscard]] double ground_below_m(const Vector3& p_W) const noexcept;
  struct NearestBody {
    double distance_m{};               ///< To its surface; 0 inside.
    Vector3 core_W = Vector3::Zero();  ///< The nearest point of its axis, or its centre.
  };
  /// The body nearest to the point at `when`, if one is nearer than cap_m.
  [[nodiscard]] std::optional<NearestBody> nearest_body(const Vector3& p_W, double cap_m,
                                                        MonotonicTime when) const noexcept;
  /// Share of 10 m cells within 30 m of (x, y) with an obstacle no farther from their centre than their
  /// corners, 0 .. 1: the colour of the heat map.
  [[nodiscard]] double congestion_ratio(double x_m, double y_m) const noexcept;

 private:
  struct Range {
    std::uint32_t first;
    std::uint32_t count;
  };
  [[nodiscard]] std::size_t column(std::int64_t ix, std::int64_t iy) const noexcept;
  [[nodiscard]] double hit_object_m(std::uint32_t object, const Vector3& origin_W,
                                    const Vector3& direction_W) const noexcept;
  [[nodiscard]] double object_distance_m(std::uint32_t object, const Vector3& p_W) const noexcept;

  WorldDescription description_;
  Vector3 grid_min_W_ = Vector3::Zero();
  std::int64_t nx_{1};
  std::int64_t ny_{1};
  std::vector<Range> column_;          ///< Objects over each grid square, into object_.
  std::vector<std::uint32_t> object_;  ///< Pillars, boxes, balls, turned: one number after the other.
};

/// Why a vehicle of this radius cannot fly in it, empty if it can: start and goal must be free, and the start must
/// have ground below it and, from where the vehicle no longer touches what it stands on, room to climb to it.
[[nodiscard]] std::string why_no_room(const World& world, double radius_m);

}  // namespace roborun::sitl
