/// What every occupancy map offers: integrate depth images, and hand a view to the planner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/depth_error.hpp"
#include "core/executive/stage_budget.hpp"
#include "core/geometry/vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/status.hpp"
#include "stages/perception/map_view.hpp"

namespace roborun::stages {

/// A depth image and where its camera was at the instant of exposure (as the estimator believes).
struct PosedDepthFrame {
  firmware_if::DepthFrame frame{};
  Pose X_WC{};
  DepthError error{};  ///< Of this camera.
  /// Made from a cloud (cloud_images.hpp): most pixels may have no information, and the range is that of a ray (empty_reach.hpp).
  bool is_cloud{false};
  Vector3 p_BC_W = Vector3::Zero();  ///< From the middle of the vehicle to the camera, at that instant.
};

struct IntegrationRequest {
  std::span<const PosedDepthFrame> frames{};  ///< Those of a cloud in a request of their own.
  int level{0};                               ///< p0: no cell finer than cell_size_m(level) is written.
  double volume_m3{0.0};  ///< v0: space nearest to `trajectory_W` first, until this is spent.
  /// Points of the committed trajectory; at least the vehicle itself.
  std::span<const Vector3> trajectory_W{};
  /// Where something was seen to move lately: what the map holds near these may be gone, and an image that
  /// shows nothing there is not suspicious (own map).
  std::span<const Vector3> moved_W{};
  /// What is unknown in a box of these half edges around the vehicle is taken to be free. Zero: nothing is. For a
  /// vehicle that has climbed where somebody chose a place for it, and does not see above itself.
  Vector3 assumed_half_m = Vector3::Zero();
};

struct IntegrationResult {
  core::Work work{};               ///< units: cells and nodes visited; volume_m3: space updated.
  std::uint32_t frames_refused{};  ///< Not used at all: check_frame(), and in the own map FrameGuard.
  std::uint32_t thin_pixels{};     ///< That showed something thin nearby; of other maps than the own one 0.
};

struct ExportRequest {
  int level{0};           ///< p1: the view answers for cells of cell_size_m(level).
  double volume_m3{0.0};  ///< v1: known space nearest to center_W first, until this is spent; unknown beyond.
  Vector3 center_W = Vector3::Zero();
};

/// Contract (proved on every implementation by tests/stages/perception/occupancy_map_contract_test.cpp):
///  1. Space never seen is unknown. A frame that was refused and a hole of NaN pixels change nothing: what lies
///     behind a hole is neither free nor occupied.
///  2. After one integration at level 0 of a clean frame, the cells that a ray crossed well before its end
///     are free, and the cell at its end (or a face neighbour) is occupied.
///  3. A free write at a coarse level never clears a finer cell in which a surface was seen in this scan.
///  4. Evidence is bounded: what moved away is free again after at most 10 scans that look through it.
///  5. After forget() it answers as a new one.
///  6. The same calls in the same order give the same map: digest() is equal, on every machine (own backend).
class OccupancyMap {
 public:
  virtual ~OccupancyMap() = default;

  /// kOk, or kBudgetSpent (budget or volume: the nearest space was integrated), or kInvalidArgument (no
  /// usable frame).
  [[nodiscard]] virtual Status integrate(const IntegrationRequest& request, core::StageBudget& budget,
                                         IntegrationResult& result) noexcept = 0;
  /// Makes view() answer for `request`. kOk, or kBudgetSpent (a smaller view), or kInvalidArgument.
  /// work.units: bricks or nodes visited; work.volume_m3: known space inside the view.
  [[nodiscard]] virtual Status export_view(const ExportRequest& request, core::StageBudget& budget,
                                           core::Work& work) noexcept = 0;
  /// Everything is unknown again, and the view is empty: what is in the map is not where it was. RT-safe: O(size of the map).
  virtual void forget() noexcept = 0;
  /// The view of the last export_view(); stays valid until the next integrate() or forget().
  [[nodiscard]] virtual const MapView& view() const noexcept = 0;

  /// Which of at most 64 cubes of 0.2 m were seen past, all over, in the images of a moment before `now`: free then, however
  /// coarse the cells are that it keeps of them. Bit i is cube i. A map that keeps no images says none.
  [[nodiscard]] virtual std::uint64_t saw_through(MonotonicTime /*now*/,
                                                  std::span<const Vector3> /*center_W*/) const noexcept {
    return 0;
  }

  [[nodiscard]] virtual double known_volume_m3() const noexcept = 0;
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
  [[nodiscard]] virtual std::uint64_t digest() const noexcept = 0;
  /// How often space was not taken because the memory is full; never decreases. A map that grows for ever has
  /// none.
  [[nodiscard]] virtual std::uint64_t refusals() const noexcept { return 0; }
};

}  // namespace roborun::stages
