/// The simulated depth cameras and LiDARs of the vehicle: read where they stand, or served to another thread.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/exchange/mailbox.hpp"
#include "core/exchange/spsc_ring.hpp"
#include "core/executive/lane_executive.hpp"
#include "platform/sitl/aircraft/simulated_aircraft.hpp"
#include "platform/sitl/sensors/depth_camera.hpp"

namespace roborun::sitl {

/// Who reads the cameras of a rig: the decision lane alone, or the flight lane, too.
enum class Readers : std::uint8_t { kOne, kTwo };

/// Lockstep: an exposure is taken at once, and rendered by whoever reads it.
class CameraRig final : public ExposureSink {
 public:
  CameraRig(const World& world, const SimulatorConfig& config, std::uint64_t seed,
            Readers readers = Readers::kOne);
  void expose(MonotonicTime now, const Pose& X_WB) noexcept override;
  /// In the order of the rig.
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept { return cameras_; }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept { return lidars_; }
  /// The same cameras, the same images, for the second reader; none where there is one.
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> watched() noexcept { return watched_; }
  /// Most points of a sweep.
  [[nodiscard]] std::size_t rays(std::size_t lidar) const noexcept { return lidar_[lidar].rays(); }

 private:
  std::vector<SimulatedDepthCamera> camera_, watched_camera_;
  std::vector<SimulatedLidar> lidar_;
  std::vector<firmware_if::DepthCamera*> cameras_, watched_;
  std::vector<firmware_if::Lidar*> lidars_;
};

/// Real time: the flight lane leaves its pose in a ring, a slot of the background lane renders, and the
/// decision lane finds each camera's newest image in a mailbox, as it would find a driver's.
class CameraServer final : public ExposureSink, public core::LaneProgram {
 public:
  CameraServer(const World& world, const SimulatorConfig& config, std::uint64_t seed);

  void expose(MonotonicTime now, const Pose& X_WB) noexcept override { exposure_.push({now, X_WB}); }
  void run(core::SlotId slot, core::LaneExecutive& lane) noexcept override;
  /// For the decision lane.
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> cameras() noexcept { return cameras_; }
  /// The same images, for the flight lane.
  [[nodiscard]] std::span<firmware_if::DepthCamera* const> watched() noexcept { return watched_; }
  [[nodiscard]] std::span<firmware_if::Lidar* const> lidars() noexcept { return lidars_; }
  /// Poses lost because the background lane did not keep up; never decreases.
  [[nodiscard]] std::uint64_t exposures_dropped() const noexcept { return exposure_.dropped(); }
  /// Least distance of the vehicle's centre to an obstacle so far, at most 2 m. Background lane's thread.
  [[nodiscard]] double least_clearance_m() const noexcept { return least_clearance_m_; }
  [[nodiscard]] const Vector3& last_p_WB() const noexcept { return last_p_WB_; }

 private:
  struct Exposure {
    MonotonicTime now{};
    Pose X_WB{};
  };
  struct Image {
    firmware_if::DepthFrame frame{};
    std::vector<float> depth_m;
  };
  class Served final : public firmware_if::DepthCamera {
   public:
    [[nodiscard]] Status read(firmware_if::DepthFrame& frame) noexcept override;
    [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
    core::Mailbox<Image> box;
    firmware_if::CameraMount mount_;
  };
  struct Sweep {
    firmware_if::LidarSweep sweep{};
    std::vector<std::array<float, 3>> points_L_m;
  };
  class ServedLidar final : public firmware_if::Lidar {
   public:
    [[nodiscard]] Status read(firmware_if::LidarSweep& sweep) noexcept override;
    [[nodiscard]] const firmware_if::CameraMount& mount() const noexcept override { return mount_; }
    core::Mailbox<Sweep> box;
    firmware_if::CameraMount mount_;
  };
  void serve(std::size_t camera, core::Work& work) noexcept;
  void serve_lidar(std::size_t lidar, core::Work& work) noexcept;

  const World& world_;
  CameraRig rig_;
  std::deque<Served> served_, served_watched_;
  std::deque<ServedLidar> served_lidar_;
  std::vector<firmware_if::DepthCamera*> cameras_, watched_;
  std::vector<firmware_if::Lidar*> lidars_;
  core::SpscRing<Exposure, 2048> exposure_;
  double least_clearance_m_{2.0};
  Vector3 last_p_WB_ = Vector3::Zero();
};

}  // namespace roborun::sitl
