#include "platform/feed/v4l2_feed.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <limits>
#include <set>

#include "platform/input/input_error.hpp"
#include "platform/sensor_port/port_devices.hpp"
#include "platform/sensor_port/port_writer.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::feed {
namespace {

constexpr std::uint32_t kWidth = 16, kHeight = 8, kRow_bytes = 40;  // 32 bytes of pixels, 8 of padding

/// What the next look at the device finds.
struct Event {
  int error{0};  ///< Of VIDIOC_DQBUF.
  std::uint16_t raw{2500};
  std::uint32_t sequence{0}, flags{V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC}, bytes{kRow_bytes * kHeight};
  std::uint32_t index{0};
  std::int64_t ahead_us{0};  ///< Of the clock.
  bool silence{false};       ///< Nothing comes, for as long as it waits.
};

/// A device as data: what each call answers.
class FakeVideo final : public VideoCalls {
 public:
  // What the device is.
  std::deque<int> open_results;  ///< 0: opens. Empty: opens always.
  int query_error{0}, format_error{0}, request_error{0}, start_error{0}, requeue_error{0};
  std::uint32_t can{V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING};
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_Z16};
  std::uint32_t width{kWidth}, height{kHeight}, row_bytes{kRow_bytes}, image_bytes{kRow_bytes * kHeight};
  std::uint32_t field{V4L2_FIELD_NONE}, buffer_count{4}, buffer_bytes{4096};
  bool maps{true};
  std::deque<Event> events;
  Nanos time{1'000'000'000'000};
  // What it saw.
  int opened{0}, closed{0};
  std::set<void*> mapped;

  int open(const std::string& /*path*/) override {
    int result = 0;
    if (!open_results.empty()) {
      result = open_results.front();
      open_results.pop_front();
    }
    if (result < 0) return result;
    return 7 + opened++;
  }
  int control(int /*fd*/, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto& c = *static_cast<v4l2_capability*>(argument);
        c.capabilities = V4L2_CAP_DEVICE_CAPS;
        c.device_caps = can;
        return query_error;
      }
      case VIDIOC_ENUM_FMT: {
        auto& f = *static_cast<v4l2_fmtdesc*>(argument);
        if (f.index >= formats.size()) return -EINVAL;
        f.pixelformat = formats[f.index];
        return 0;
      }
      case VIDIOC_G_FMT:
      case VIDIOC_S_FMT: {
        v4l2_pix_format& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (std::find(formats.begin(), formats.end(), pix.pixelformat) == formats.end())
          pix.pixelformat = formats.front();
        pix.width = width;
        pix.height = height;
        pix.bytesperline = row_bytes;
        pix.sizeimage = image_bytes;
        pix.field = field;
        return format_error;
      }
      case VIDIOC_REQBUFS:
        static_cast<v4l2_requestbuffers*>(argument)->count = buffer_count;
        return request_error;
      case VIDIOC_QUERYBUF: {
        auto& b = *static_cast<v4l2_buffer*>(argument);
        b.length = buffer_bytes;
        b.m.offset = b.index * buffer_bytes;
        return 0;
      }
      case VIDIOC_STREAMON:
        return start_error;
      case VIDIOC_QBUF:
        return events.empty() && opened > 0 ? 0 : requeue_error;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return 0;
    }
  }
  void* map(int /*fd*/, std::size_t bytes, std::int64_t offset) override {
    if (!maps) return nullptr;
    memory_.resize(std::max(memory_.size(), static_cast<std::size_t>(offset) / bytes + 1));
    std::vector<std::byte>& one = memory_[static_cast<std::size_t>(offset) / bytes];
    one.assign(bytes, std::byte{0xEE});
    mapped.insert(one.data());
    return one.data();
  }
  void unmap(void* memory, std::size_t /*bytes*/) override { mapped.erase(memory); }
  int wait(int /*fd*/, Nanos most) override {
    if (events.empty() || !events.front().silence) {
      time += Nanos{33'000'000};
      return 1;
    }
    time += most;
    if (--silent_looks_ < 0) events.pop_front();
    return 0;
  }
  void close(int /*fd*/) override { ++closed; }
  Nanos now() override { return time; }
  void pause(Nanos duration) override { time += duration; }
  void silent_for(int looks) {
    silent_looks_ = looks;
    Event event;
    event.silence = true;
    events.push_back(event);
  }

 private:
  int dequeue(v4l2_buffer& buffer) {
    if (events.empty()) return -EAGAIN;
    const Event event = events.front();
    events.pop_front();
    if (event.error < 0) return event.error;
    buffer.index = event.index;
    buffer.sequence = event.sequence;
    buffer.flags = event.flags;
    buffer.bytesused = event.bytes;
    const std::int64_t us = time.count() / 1000 + event.ahead_us;
    buffer.timestamp = {us / 1'000'000, us % 1'000'000};
    if (event.index < memory_.size())
      for (std::uint32_t v = 0; v < kHeight; ++v)
        for (std::uint32_t u = 0; u < kWidth; ++u) {
          const auto raw = static_cast<std::uint16_t>(event.raw + u);
          std::memcpy(memory_[event.index].data() + v * kRow_bytes + 2 * u, &raw, sizeof raw);
        }
    return 0;
  }
  std::deque<std::vector<std::byte>> memory_;
  int silent_looks_{0};
};

Event image(std::uint32_t sequence, std::uint32_t index = 0) {
  Event event;
  event.sequence = sequence;
  event.index = index;
  return event;
}
Event lost(int error) {
  Event event;
  event.error = error;
  return event;
}

/// A feed that ends once the device has told everything.
struct Feed {
  explicit Feed(FakeVideo& video_) : video(video_) {
    static int count = 0;
    config.wish.device = "/dev/video9";
    config.port = scratch_port(++count);
    config.intrinsics = std::array<double, 4>{16.0, 16.0, 7.5, 3.5};
    config.camera.range_m = 10.0;
    config.stop = [this] { return video.events.empty(); };
    config.say = [this](const std::string& line) { said.push_back(line); };
  }
  static std::string scratch_port(int number) { return test::scratch("v4l2-" + std::to_string(number)); }
  /// `port` reads from now on what is written.
  V4l2FeedCounters run() {
    {
      sensor_port::PortWriter layout;
      EXPECT_EQ(layout.open(config.port, ROBORUN_PORT_DEPTH, 2 * kWidth * kHeight, 4), "");
    }
    EXPECT_EQ(port.open(config.port, {}), "");
    return feed_v4l2(video, config);
  }

  FakeVideo& video;
  V4l2FeedConfig config;
  std::vector<std::string> said;
  sensor_port::PortDepthCamera port;
};

std::string complaint_of(FakeVideo& video, const std::function<void(V4l2FeedConfig&)>& change = {}) {
  video.events = {image(0)};
  Feed feed(video);
  if (change) change(feed.config);
  try {
    (void)feed.run();
    return "none";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(V4l2Feed, BringsImagesToThePortWithoutTheirPadding) {
  FakeVideo video;
  video.events = {image(0), image(1, 1), image(4, 2)};  // two were lost by the driver
  Feed sut(video);
  sut.config.camera.mount.x_m = 0.25;
  sut.config.camera.mount.yaw_deg = 90.0;
  EXPECT_EQ(sut.run().images, 3U);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut.port.read(frame), Status::kOk);
  EXPECT_EQ(frame.sequence, 5U);
  EXPECT_EQ(frame.width, kWidth);
  EXPECT_EQ(frame.height, kHeight);
  EXPECT_FLOAT_EQ(frame.tan_half_width, 0.5F);
  EXPECT_FLOAT_EQ(frame.tan_half_height, 0.25F);
  EXPECT_EQ(frame.range_m, 10.0F);
  EXPECT_EQ(frame.stamp.time_since_epoch(), Nanos{1'000'000'000'000 + 3 * 33'000'000});
  for (std::uint32_t v = 0; v < kHeight; ++v)
    for (std::uint32_t u = 0; u < kWidth; ++u)
      ASSERT_FLOAT_EQ(frame.depth_m[v * kWidth + u], 0.001F * static_cast<float>(2500 + u)) << u << ", " << v;
  EXPECT_NEAR(sut.port.mount().p_BC_m[0], 0.25, 1e-6);
  EXPECT_NEAR(sut.port.mount().R_BC[3], 1.0, 1e-6) << "looks to the left";
  EXPECT_EQ(video.opened, video.closed);
  EXPECT_TRUE(video.mapped.empty());
}

TEST(V4l2Feed, OpticsAreTheVehiclesWhereNoneWereMeasured) {
  FakeVideo video;
  video.events = {image(0)};
  Feed sut(video);
  sut.config.intrinsics.reset();
  sut.config.camera.tan_half_width = 0.9;
  sut.config.camera.tan_half_height = 0.5;
  (void)sut.run();
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut.port.read(frame), Status::kOk);
  EXPECT_FLOAT_EQ(frame.tan_half_width, 0.9F);
  EXPECT_FLOAT_EQ(frame.tan_half_height, 0.5F);
}

TEST(V4l2Feed, TakesY16OnlyWhereItsUnitIsSaid) {
  FakeVideo video;
  video.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_Y16};
  EXPECT_EQ(complaint_of(video), "/dev/video9: gives YUYV, Y16: must be Z16, or Y16 with --unit-m");
  video.events = {image(0)};
  Feed sut(video);
  sut.config.wish.takes_y16 = true;
  sut.config.unit_m = 0.01;
  EXPECT_EQ(sut.run().images, 1U);
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut.port.read(frame), Status::kOk);
  EXPECT_EQ(frame.range_m, 10.0F);
  EXPECT_FLOAT_EQ(frame.depth_m[0], 25.0F);
}

TEST(V4l2Feed, RefusesInOneLineWhatIsNoDepthCamera) {
  struct Case {
    std::function<void(FakeVideo&)> device;
    std::string says;
  };
  const std::vector<Case> cases{
      {[](FakeVideo& d) { d.open_results = {-ENOENT}; }, "/dev/video9: No such file or directory"},
      {[](FakeVideo& d) { d.open_results = {-EACCES}; }, "by the group video"},
      {[](FakeVideo& d) { d.query_error = -ENOTTY; }, "is no video device"},
      {[](FakeVideo& d) { d.can = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING; }, "captures no images"},
      {[](FakeVideo& d) { d.can = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE; }, "captures no images"},
      {[](FakeVideo& d) { d.formats = {V4L2_PIX_FMT_MJPEG}; }, "gives MJPG: must be Z16"},
      {[](FakeVideo& d) { d.format_error = -EBUSY; }, "another program uses it"},
      {[](FakeVideo& d) { d.format_error = -EIO; }, "VIDIOC_G_FMT: Input/output error"},
      {[](FakeVideo& d) { d.width = 4; }, "gives 4 x 8 pixels: must be 8 to 1280 each"},
      {[](FakeVideo& d) { d.width = 4'000'000'000U; }, "gives 4000000000 x 8 pixels"},
      {[](FakeVideo& d) { d.field = V4L2_FIELD_INTERLACED; }, "interlaced"},
      {[](FakeVideo& d) { d.row_bytes = 31; }, "rows of 31 bytes and 16 pixels: impossible"},
      {[](FakeVideo& d) { d.row_bytes = 4'000'000'000U; }, "impossible"},
      {[](FakeVideo& d) { d.image_bytes = 311; }, "says 311 bytes for 8 rows of 40"},
      {[](FakeVideo& d) { d.image_bytes = 4'000'000'000U; }, "impossible"},
      {[](FakeVideo& d) { d.buffer_count = 1; }, "has 1 buffers"},
      {[](FakeVideo& d) { d.request_error = -EBUSY; }, "another program uses it (VIDIOC_REQBUFS)"},
      {[](FakeVideo& d) { d.buffer_bytes = 300; }, "its buffer of 300 bytes holds no image of 312"},
      {[](FakeVideo& d) { d.maps = false; }, "cannot be mapped"},
      {[](FakeVideo& d) { d.start_error = -ENOSPC; }, "VIDIOC_STREAMON: No space left"}};
  for (const Case& c : cases) {
    FakeVideo video;
    c.device(video);
    const std::string said = complaint_of(video);
    EXPECT_NE(said.find(c.says), std::string::npos) << said << " does not say " << c.says;
    EXPECT_EQ(said.find('\n'), std::string::npos);
    EXPECT_EQ(video.opened, video.closed) << c.says;
    EXPECT_TRUE(video.mapped.empty()) << c.says;
  }
  FakeVideo video;
  EXPECT_EQ(complaint_of(video, [](V4l2FeedConfig& config) { config.wish.width = 32; }),
            "/dev/video9: gives 16 x 8 pixels: must be 32 x 0");
}

TEST(V4l2Feed, LeavesOutDamagedImagesAndSaysSoOnce) {
  FakeVideo video;
  Event error = image(1), shorter = image(2), longer = image(3);
  error.flags |= V4L2_BUF_FLAG_ERROR;
  shorter.bytes = kRow_bytes * (kHeight - 1);
  longer.bytes = 5000;
  video.events = {image(0), error, shorter, longer, image(4)};
  Feed sut(video);
  const V4l2FeedCounters counters = sut.run();
  EXPECT_EQ(counters.images, 2U);
  EXPECT_EQ(counters.damaged, 3U);
  EXPECT_EQ(counters.losses, 0U);
  EXPECT_EQ(sut.said.size(), 1U);
}

TEST(V4l2Feed, StampsWithItsOwnClockWhereTheDriversIsUnknownOrAhead) {
  FakeVideo video;
  Event unknown = image(0);
  unknown.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  video.events = {unknown};
  Feed sut(video);
  (void)sut.run();
  firmware_if::DepthFrame frame;
  ASSERT_EQ(sut.port.read(frame), Status::kOk);
  EXPECT_EQ(frame.stamp.time_since_epoch(), video.time);
  Event ahead = image(1);
  ahead.ahead_us = 170'000;
  video.events = {ahead};
  (void)sut.run();
  ASSERT_EQ(sut.port.read(frame), Status::kOk);
  EXPECT_EQ(frame.stamp.time_since_epoch(), video.time) << "no image is taken after it came";
}

TEST(V4l2Feed, OpensALostCameraAgainAndGoesOn) {
  for (const Event& end : {lost(-ENODEV), lost(-EIO), image(9, 17)}) {  // 17: no such buffer
    FakeVideo video;
    video.events = {image(0), image(1), end, image(0), image(1)};
    video.open_results = {0, -ENOENT, -ENOENT, 0};
    Feed sut(video);
    const V4l2FeedCounters counters = sut.run();
    EXPECT_EQ(counters.images, 4U);
    EXPECT_EQ(counters.losses, 1U);
    ASSERT_EQ(sut.said.size(), 1U) << "once, not at each attempt";
    EXPECT_NE(sut.said[0].find("lost: tried again once per second"), std::string::npos) << sut.said[0];
    firmware_if::DepthFrame frame;
    ASSERT_EQ(sut.port.read(frame), Status::kOk);
    EXPECT_EQ(frame.sequence, 4U) << "numbers go on";
    EXPECT_EQ(video.opened, video.closed);
    EXPECT_EQ(video.opened, 2);
  }
}

TEST(V4l2Feed, OpensASilentCameraAgain) {
  FakeVideo video;
  video.events = {image(0)};
  video.silent_for(25);
  video.events.push_back(image(1));
  Feed sut(video);
  const V4l2FeedCounters counters = sut.run();
  EXPECT_EQ(counters.images, 2U);
  EXPECT_EQ(counters.losses, 1U);
  ASSERT_FALSE(sut.said.empty());
  EXPECT_NE(sut.said[0].find("no whole image for 2 s"), std::string::npos) << sut.said[0];
}

TEST(V4l2Feed, EndsWhenALostCameraStaysAway) {
  FakeVideo video;
  video.events = {image(0), lost(-ENODEV), image(1)};
  video.open_results = {0};
  for (int i = 0; i < 1000; ++i) video.open_results.push_back(-ENOENT);
  Feed sut(video);
  const Nanos begun = video.time;
  try {
    (void)sut.run();
    FAIL() << "it ended without a word";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "/dev/video9: No such file or directory: lost, and no image for 60 s");
  }
  EXPECT_NEAR(seconds(video.time - begun), 60.0, 3.0);
}

TEST(V4l2Feed, TheDevicesOfThisMachineThatAreNoCamerasAreRefused) {
  LinuxVideo calls;
  for (const char* path : {"/dev/null", "/dev/roborun-not-there"}) {
    CaptureWish wish;
    wish.device = path;
    EXPECT_THROW(V4l2Capture(calls, wish), InputError) << path;
  }
}

}  // namespace
}  // namespace roborun::feed
