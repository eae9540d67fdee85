/// Where ports are, and which ones a vehicle has.
#pragma once

#include <cstddef>
#include <string>

namespace roborun::sensor_port {

inline constexpr const char* kPortFolder = "/dev/shm";
inline constexpr const char* kPortPrefix = "roborun-";

/// A name stands for a file /dev/shm/roborun-NAME; what has a slash is a file.
[[nodiscard]] std::string port_path(const std::string& name);
/// A writer holds the file's lock as long as it lives. Not for the loop.
[[nodiscard]] bool is_written_to(const std::string& path);

/// The ports of a vehicle NAME: NAME-imu, NAME-camera1, ...; paths.
class VehiclePorts {
 public:
  explicit VehiclePorts(const std::string& name) : base_(port_path(name)) {}
  [[nodiscard]] std::string camera(std::size_t index) const { return numbered("camera", index); }
  [[nodiscard]] std::string lidar(std::size_t index) const { return numbered("lidar", index); }
  [[nodiscard]] std::string imu() const { return base_ + "-imu"; }
  [[nodiscard]] std::string gnss() const { return base_ + "-gnss"; }
  [[nodiscard]] std::string odometry() const { return base_ + "-odometry"; }
  [[nodiscard]] std::string pressure() const { return base_ + "-pressure"; }
  [[nodiscard]] std::string lines() const { return base_ + "-lines"; }
  /// Of a simulation: where the vehicle really is, as odometry.
  [[nodiscard]] std::string truth() const { return base_ + "-truth"; }
  /// What the runtime's node hears on the bus ...
  [[nodiscard]] std::string bus_in() const { return base_ + "-bus-in"; }
  /// ... and what it sends.
  [[nodiscard]] std::string bus_out() const { return base_ + "-bus-out"; }

 private:
  [[nodiscard]] std::string numbered(const char* kind, std::size_t index) const {
    return base_ + "-" + kind + std::to_string(index + 1);
  }
  std::string base_;
};

}  // namespace roborun::sensor_port
