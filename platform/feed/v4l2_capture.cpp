#include "platform/feed/v4l2_capture.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "platform/input/input_error.hpp"
#include "platform/sensor_port/roborun_port.h"

namespace roborun::feed {
namespace {

constexpr std::uint32_t kBuffers = 4;
constexpr std::uint32_t kLeastSide = 8, kMostSide = 1280;  // what a port takes
constexpr std::size_t kPixel_bytes = 2;

/// Four letters; what is none is not printed.
std::string name_of(std::uint32_t format) {
  std::string name;
  for (unsigned i = 0; i < 4; ++i) {
    const auto letter = static_cast<char>(format >> (8 * i) & 0x7FU);
    name += letter > ' ' && letter < '\x7F' ? letter : '?';
  }
  while (name.size() > 1 && name.back() == '?') name.pop_back();
  return name;
}

v4l2_buffer buffer_of(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

V4l2Capture::V4l2Capture(VideoCalls& calls, const CaptureWish& wish) : calls_(calls), device_(wish.device) {
  fd_ = calls_.open(device_);
  if (fd_ < 0)
    throw InputError(fmt::format("{}: {}{}", device_, strerror(-fd_),
                                 fd_ == -EACCES ? ": must be readable, by the group video for example" : ""));
  try {
    check_kind();
    choose_format(wish);
    map_buffers();
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    need(VIDIOC_STREAMON, "VIDIOC_STREAMON", &type);
  } catch (...) {
    end();
    throw;
  }
}

V4l2Capture::~V4l2Capture() { end(); }

void V4l2Capture::end() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)calls_.control(fd_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& buffer : buffers_) calls_.unmap(buffer.memory, buffer.bytes);
  calls_.close(fd_);
}

int V4l2Capture::need(unsigned long request, const char* name, void* argument) {
  const int result = calls_.control(fd_, request, argument);
  if (result == -EBUSY) throw InputError(fmt::format("{}: another program uses it ({})", device_, name));
  if (result < 0) throw InputError(fmt::format("{}: {}: {}", device_, name, strerror(-result)));
  return result;
}

void V4l2Capture::check_kind() {
  v4l2_capability capability{};
  if (const int error = calls_.control(fd_, VIDIOC_QUERYCAP, &capability); error < 0)
    throw InputError(
        fmt::format("{}: is no video device ({}): must be one as /dev/video0", device_, strerror(-error)));
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
    throw InputError(fmt::format(
        "{}: captures no images through mapped buffers: another /dev/video of the same camera may", device_));
}

std::string V4l2Capture::formats() {
  constexpr std::uint32_t kMost = 32;
  std::string names;
  for (std::uint32_t i = 0; i < kMost; ++i) {
    v4l2_fmtdesc one{};
    one.index = i;
    one.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls_.control(fd_, VIDIOC_ENUM_FMT, &one) < 0) break;
    names += (names.empty() ? "" : ", ") + name_of(one.pixelformat);
  }
  return names.empty() ? "nothing" : names;
}

void V4l2Capture::choose_format(const CaptureWish& wish) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  need(VIDIOC_G_FMT, "VIDIOC_G_FMT", &format);
  const std::uint32_t width = wish.width > 0 ? wish.width : format.fmt.pix.width;
  const std::uint32_t height = wish.height > 0 ? wish.height : format.fmt.pix.height;
  bool is_taken = false;
  for (const std::uint32_t wanted : {V4L2_PIX_FMT_Z16, V4L2_PIX_FMT_Y16}) {
    if (wanted == V4L2_PIX_FMT_Y16 && !wish.takes_y16) continue;
    format.fmt.pix.width = width;
    format.fmt.pix.height = height;
    format.fmt.pix.pixelformat = wanted;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.bytesperline = format.fmt.pix.sizeimage = 0;
    need(VIDIOC_S_FMT, "VIDIOC_S_FMT", &format);
    is_taken = format.fmt.pix.pixelformat == wanted;
    if (is_taken) break;
  }
  if (!is_taken)
    throw InputError(fmt::format("{}: gives {}: must be Z16{}", device_, formats(),
                                 wish.takes_y16 ? " or Y16" : ", or Y16 with --unit-m"));
  const v4l2_pix_format& pix = format.fmt.pix;
  if (pix.width < kLeastSide || pix.width > kMostSide || pix.height < kLeastSide || pix.height > kMostSide)
    throw InputError(fmt::format("{}: gives {} x {} pixels: must be {} to {} each", device_, pix.width,
                                 pix.height, kLeastSide, kMostSide));
  if ((wish.width > 0 && pix.width != wish.width) || (wish.height > 0 && pix.height != wish.height))
    throw InputError(fmt::format("{}: gives {} x {} pixels: must be {} x {}", device_, pix.width, pix.height,
                                 wish.width, wish.height));
  if (pix.field != V4L2_FIELD_NONE)
    throw InputError(fmt::format("{}: gives interlaced images: must be whole ones", device_));
  const std::size_t row_bytes =
      kPixel_bytes * pix.width;  // of 32 bits on some machines: a driver may say more
  if (pix.bytesperline < row_bytes || pix.sizeimage > ROBORUN_PORT_MOST_BYTES ||
      pix.sizeimage < (pix.height - 1) * std::uint64_t{pix.bytesperline} + row_bytes)
    throw InputError(
        fmt::format("{}: its driver says {} bytes for {} rows of {} bytes and {} pixels: impossible", device_,
                    pix.sizeimage, pix.height, pix.bytesperline, pix.width));
  width_ = pix.width;
  height_ = pix.height;
  row_bytes_ = pix.bytesperline;
  image_bytes_ = (height_ - 1) * row_bytes_ + row_bytes;
  pixels_.resize(row_bytes * height_);
}

void V4l2Capture::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  need(VIDIOC_REQBUFS, "VIDIOC_REQBUFS", &request);
  if (request.count < 2)
    throw InputError(fmt::format("{}: has {} buffers: must be 2 at least", device_, request.count));
  for (std::uint32_t i = 0; i < std::min(request.count, kBuffers); ++i) {
    v4l2_buffer buffer = buffer_of(i);
    need(VIDIOC_QUERYBUF, "VIDIOC_QUERYBUF", &buffer);
    if (buffer.length < image_bytes_ || buffer.length > 2 * ROBORUN_PORT_MOST_BYTES)
      throw InputError(fmt::format("{}: its buffer of {} bytes holds no image of {}", device_, buffer.length,
                                   image_bytes_));
    void* const memory = calls_.map(fd_, buffer.length, buffer.m.offset);
    if (memory == nullptr) throw InputError(fmt::format("{}: its buffers cannot be mapped", device_));
    buffers_.push_back({memory, buffer.length});
    buffer = buffer_of(i);
    need(VIDIOC_QBUF, "VIDIOC_QBUF", &buffer);
  }
}

V4l2Capture::Got V4l2Capture::lose(const char* what, int error) {
  why_lost_ = error < 0 ? fmt::format("{}: {}", what, strerror(-error)) : what;
  return Got::kLost;
}

V4l2Capture::Got V4l2Capture::next(Image& image, Nanos patience) {
  if (!why_lost_.empty()) return Got::kLost;
  if (const int ready = calls_.wait(fd_, patience); ready <= 0)
    return ready == 0 ? Got::kNothing : lose("poll", ready);
  v4l2_buffer buffer = buffer_of(0);
  if (const int error = calls_.control(fd_, VIDIOC_DQBUF, &buffer); error < 0)
    return error == -EAGAIN ? Got::kNothing : lose("VIDIOC_DQBUF", error);
  if (buffer.index >= buffers_.size()) return lose("its driver names a buffer that is not there", 0);
  const bool is_whole = (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused >= image_bytes_ &&
                        buffer.bytesused <= buffers_[buffer.index].bytes;
  if (is_whole) {
    const auto* const from = static_cast<const std::byte*>(buffers_[buffer.index].memory);
    const std::size_t row = kPixel_bytes * width_;
    for (std::size_t v = 0; v < height_; ++v)
      std::memcpy(pixels_.data() + v * row, from + v * row_bytes_, row);
    const bool is_monotonic =
        (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    // Without a stamp that can be true: when it came.
    image.stamp_ns = calls_.now().count();
    if (is_monotonic)
      image.stamp_ns = std::min(image.stamp_ns, std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                                                    std::int64_t{buffer.timestamp.tv_usec} * 1000);
    image.sequence = buffer.sequence;
    image.pixels = pixels_;
  }
  v4l2_buffer back = buffer_of(buffer.index);
  if (const int error = calls_.control(fd_, VIDIOC_QBUF, &back); error < 0) return lose("VIDIOC_QBUF", error);
  return is_whole ? Got::kImage : Got::kDamaged;
}

}  // namespace roborun::feed
