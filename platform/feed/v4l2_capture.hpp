/// Depth images of a camera of the kernel (Video4Linux): streaming through mapped buffers. Source: the kernel's
/// userspace-api/media/v4l (mmap, pixfmt-z16, pixfmt-y16). A driver is believed no size and no index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "platform/feed/video_calls.hpp"

namespace roborun::feed {

struct CaptureWish {
  std::string device;     ///< Such as /dev/video2.
  bool takes_y16{false};  ///< Y16 where there is no Z16; it is as often the brightness of an infrared camera.
  /// Pixels. 0: as the device is set.
  std::uint32_t width{0}, height{0};
};

/// One thread. Streams as long as it lives.
class V4l2Capture {
 public:
  enum class Got : std::uint8_t {
    kImage,
    kNothing,  ///< None came in time.
    kDamaged,  ///< One that the driver marks as damaged, or that is too short.
    kLost      ///< The device is gone or broken: why_lost(). For ever.
  };
  struct Image {
    std::int64_t stamp_ns{};            ///< CLOCK_MONOTONIC.
    std::uint32_t sequence{};           ///< The driver's: grows over images that it lost.
    std::span<const std::byte> pixels;  ///< 16 bits each, row by row without gaps. Until the next call.
  };

  /// Throws InputError in one line: what is wrong with the device, and what would be right.
  V4l2Capture(VideoCalls& calls, const CaptureWish& wish);
  ~V4l2Capture();
  V4l2Capture(const V4l2Capture&) = delete;
  V4l2Capture& operator=(const V4l2Capture&) = delete;

  [[nodiscard]] Got next(Image& image, Nanos patience);
  [[nodiscard]] const std::string& why_lost() const { return why_lost_; }
  [[nodiscard]] std::uint32_t width() const { return width_; }
  [[nodiscard]] std::uint32_t height() const { return height_; }

 private:
  struct Buffer {
    void* memory{};
    std::size_t bytes{};
  };
  void check_kind();
  void choose_format(const CaptureWish& wish);
  [[nodiscard]] std::string formats();
  void map_buffers();
  /// 0 or more; otherwise throws.
  int need(unsigned long request, const char* name, void* argument);
  [[nodiscard]] Got lose(const char* what, int error);
  void end();

  VideoCalls& calls_;
  std::string device_;
  int fd_{-1};
  std::uint32_t width_{}, height_{};
  std::size_t row_bytes_{}, image_bytes_{};  ///< In a buffer.
  std::vector<Buffer> buffers_;
  std::vector<std::byte> pixels_;
  std::string why_lost_;
};

}  // namespace roborun::feed
