/// A port that this process writes.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "core/geometry/vector.hpp"
#include "firmware_if/depth_camera.hpp"
#include "platform/input/input_error.hpp"
#include "platform/sensor_port/roborun_port.h"

namespace roborun::sensor_port {

/// What stands before the pixels of this image (float32, metres). Its mount is that of a sensor in the body's place and axes.
[[nodiscard]] inline roborun_port_depth depth_header(const firmware_if::DepthFrame& f,
                                                     const roborun_port_stamp& at) noexcept {
  roborun_port_depth d{};
  d.at = at;
  d.width = f.width;
  d.height = f.height;
  d.pixel = ROBORUN_PORT_FLOAT32_M;
  d.fx = 0.5F * static_cast<float>(f.width) / f.tan_half_width;
  d.fy = 0.5F * static_cast<float>(f.height) / f.tan_half_height;
  d.cx = 0.5F * static_cast<float>(f.width) - 0.5F;
  d.cy = 0.5F * static_cast<float>(f.height) - 0.5F;
  d.range_min_m = f.range_min_m;
  d.range_m = f.range_m;
  d.mount.q_BS[0] = 1.0F;
  return d;
}

/// Where a sensor sits, as a port says it.
[[nodiscard]] inline roborun_port_mount port_mount(const firmware_if::CameraMount& mount) noexcept {
  const Quaternion q(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(mount.R_BC.data()));
  roborun_port_mount out{};
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  for (std::size_t i = 0; i < 4; ++i) out.q_BS[i] = static_cast<float>(wxyz.at(i));
  for (std::size_t i = 0; i < 3; ++i) out.p_BS_m[i] = static_cast<float>(mount.p_BC_m.at(i));
  return out;
}

class PortWriter {
 public:
  PortWriter() = default;
  ~PortWriter() { roborun_port_close(&writer_); }
  PortWriter(const PortWriter&) = delete;
  PortWriter& operator=(const PortWriter&) = delete;

  /// Empty: open. Otherwise what is wrong, in one line without the path. Not for the loop.
  [[nodiscard]] std::string open(const std::string& path, std::uint32_t kind, std::size_t most_payload_bytes,
                                 std::uint32_t slots) {
    roborun_port_close(&writer_);
    const char* wrong = roborun_port_open(&writer_, path.c_str(), kind,
                                          static_cast<std::uint32_t>(most_payload_bytes), slots);
    return wrong != nullptr ? wrong : "";
  }
  [[nodiscard]] bool is_open() const noexcept { return writer_.header != nullptr; }
  /// False: larger than the port was made for, or not open. Neither waits nor calls the system.
  template <typename Sample>
  bool write(const Sample& sample, std::span<const std::byte> payload = {}) noexcept {
    return write_bytes(std::as_bytes(std::span(&sample, 1)), payload);
  }
  /// The same. Precondition: `sample` has the bytes of the kind's struct.
  bool write_bytes(std::span<const std::byte> sample, std::span<const std::byte> payload) noexcept {
    return is_open() && roborun_port_write(&writer_, sample.data(), payload.data(),
                                           static_cast<std::uint32_t>(payload.size_bytes())) == 0;
  }

 private:
  roborun_port_writer writer_{-1, 0, nullptr};
};

/// As PortWriter::open(). Throws InputError that names the path.
inline void open_port(PortWriter& port, const std::string& path, std::uint32_t kind, std::size_t most_bytes,
                      std::uint32_t slots) {
  const std::string wrong = port.open(path, kind, most_bytes, slots);
  if (!wrong.empty()) throw InputError(fmt::format("{}: {}", path, wrong));
}

}  // namespace roborun::sensor_port
