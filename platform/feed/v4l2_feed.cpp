#include "platform/feed/v4l2_feed.hpp"

#include <fmt/format.h>

#include "platform/input/input_error.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::feed {
namespace {

constexpr Nanos kLook{100'000'000};
constexpr Nanos kMostSilent{2'000'000'000};
constexpr Nanos kRetry{1'000'000'000};
constexpr std::uint32_t kSlots = 4;

roborun_port_depth header_of(const V4l2FeedConfig& config, std::uint32_t width, std::uint32_t height) {
  roborun_port_depth d{};
  d.width = width;
  d.height = height;
  d.pixel = ROBORUN_PORT_UINT16;
  d.unit_m = static_cast<float>(config.unit_m);
  const std::array<double, 4> optics = config.intrinsics.value_or(std::array<double, 4>{
      0.5 * width / config.camera.tan_half_width, 0.5 * height / config.camera.tan_half_height,
      0.5 * width - 0.5, 0.5 * height - 0.5});
  d.fx = static_cast<float>(optics[0]);
  d.fy = static_cast<float>(optics[1]);
  d.cx = static_cast<float>(optics[2]);
  d.cy = static_cast<float>(optics[3]);
  d.range_min_m = static_cast<float>(config.camera.range_min_m);
  d.range_m = static_cast<float>(config.camera.range_m);
  d.mount = sensor_port::port_mount(camera_mount(config.camera.mount));
  return d;
}

class V4l2Feed {
 public:
  V4l2Feed(VideoCalls& calls, const V4l2FeedConfig& config)
      : calls_(calls), config_(config), wish_(config.wish) {}

  V4l2FeedCounters run() {
    for (bool is_first = true; !config_.stop(); is_first = false) {
      std::string why;
      try {
        V4l2Capture capture(calls_, wish_);
        if (is_first) begin(capture);
        why = stream(capture);
        if (why.empty()) break;
        ++counters_.losses;
      } catch (const InputError& error) {
        if (is_first) throw;
        why = error.what();
      }
      give_up_or_wait(why);
    }
    return counters_;
  }

 private:
  void begin(const V4l2Capture& capture) {
    wish_.width = capture.width();
    wish_.height = capture.height();
    header_ = header_of(config_, wish_.width, wish_.height);
    sensor_port::open_port(port_, config_.port, ROBORUN_PORT_DEPTH,
                           std::size_t{2} * wish_.width * wish_.height, kSlots);
    last_image_ = calls_.now();
  }

  /// Empty: stopped. Otherwise why there are no more images.
  std::string stream(V4l2Capture& capture) {
    const Nanos begun = calls_.now();
    const std::uint32_t before = header_.at.sequence;
    while (!config_.stop()) {
      V4l2Capture::Image image;
      switch (capture.next(image, kLook)) {
        case V4l2Capture::Got::kImage:
          is_lost_ = false;
          last_image_ = calls_.now();
          header_.at.stamp_ns = image.stamp_ns;
          header_.at.sequence = before + 1 + image.sequence;  // drivers begin with 0
          port_.write(header_, image.pixels);
          ++counters_.images;
          break;
        case V4l2Capture::Got::kDamaged:
          if (++counters_.damaged == 1)
            config_.say(fmt::format("{}: a damaged image was left out", wish_.device));
          break;
        case V4l2Capture::Got::kLost:
          return fmt::format("{}: {}", wish_.device, capture.why_lost());
        case V4l2Capture::Got::kNothing:
          break;
      }
      if (calls_.now() - std::max(begun, last_image_) > kMostSilent)
        return fmt::format("{}: no whole image for {:.0f} s", wish_.device, seconds(kMostSilent));
    }
    return {};
  }

  void give_up_or_wait(const std::string& why) {
    if (calls_.now() - last_image_ > kMostLost)
      throw InputError(fmt::format("{}: lost, and no image for {:.0f} s", why, seconds(kMostLost)));
    if (!std::exchange(is_lost_, true))
      config_.say(fmt::format("{}: lost: tried again once per second", why));
    const Nanos until = calls_.now() + kRetry;
    while (!config_.stop() && calls_.now() < until) calls_.pause(kLook);
  }

  VideoCalls& calls_;
  const V4l2FeedConfig& config_;
  CaptureWish wish_;
  sensor_port::PortWriter port_;
  roborun_port_depth header_{};
  V4l2FeedCounters counters_;
  Nanos last_image_{};
  bool is_lost_{false};
};

}  // namespace

V4l2FeedCounters feed_v4l2(VideoCalls& calls, const V4l2FeedConfig& config) {
  return V4l2Feed(calls, config).run();
}

}  // namespace roborun::feed
