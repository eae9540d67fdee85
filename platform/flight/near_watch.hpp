/// Looks while a decision still thinks: what a new image shows in the way, so near that the vehicle has to brake now.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/depth_error.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/static_vector.hpp"
#include "core/sensor_rig.hpp"
#include "core/trajectory.hpp"
#include "firmware_if/depth_camera.hpp"
#include "firmware_if/time.hpp"
#include "stages/control/past_states.hpp"
#include "stages/perception/swept_pixels.hpp"

namespace roborun::flight {

/// A pixel is in the way if it ends in what the vehicle sweeps from now to where it would stand if it braked in 0.1 s, and 0.3 m
/// more, by two sigma of its depth; three such pixels of one image are enough. There is no memory: what it sees is near, and
/// from where the vehicle stands then the map sees it better.
class NearWatch {
 public:
  struct Config {
    double radius_m{};  ///< Of the vehicle, and what it errs by while it is slow.
    double braking_mps2{};
    std::array<DepthError, kMostCameras> error{};
  };
  /// While decisions look more often there is nothing to do.
  static constexpr Nanos kOften{200'000'000};
  /// At most one image of a camera.
  static constexpr Nanos kEvery{100'000'000};

  /// `cameras`: those of the decisions once more, read by nobody else; none: it never sees anything. At most kMostCameras.
  NearWatch(const Config& config, std::span<firmware_if::DepthCamera* const> cameras) noexcept;

  struct Input {
    MonotonicTime now{};
    MonotonicTime looked{};   ///< When the newest decision read its images,
    MonotonicTime due{};      ///< and when the next one is to.
    std::uint32_t refused{};  ///< Bit i: it did not believe camera i.
    const Trajectory& committed;
    std::uint64_t committed_number{};
    const stages::PastStates& past;
  };
  /// Once a minor frame. Reads one image at most, or looks at some rows of the last one. RT-safe: O(1), no allocation; a read costs what
  /// the device takes.
  [[nodiscard]] bool must_brake(const Input& in) noexcept;

 private:
  using Way = std::array<Vector3, stages::SweptWay::kMost>;
  /// Where it would go, world frame. False: it stands.
  [[nodiscard]] bool way_W(const Input& in, Way& way) const noexcept;
  /// The newest image of the next camera, if one is due and it looks along the way.
  void take_image(const Input& in) noexcept;

  Config config_;
  core::StaticVector<firmware_if::DepthCamera*, kMostCameras> cameras_;
  std::array<MonotonicTime, kMostCameras> read_{};
  std::size_t camera_{0};
  firmware_if::DepthFrame frame_{};  ///< The image that is looked at,
  std::size_t row_{0};               ///< from this row on; its height: none is.
  stages::SweptWay swept_{};
  std::size_t in_the_way_{0};  ///< Pixels of the rows before.
  std::uint64_t committed_number_{0};
};

}  // namespace roborun::flight
