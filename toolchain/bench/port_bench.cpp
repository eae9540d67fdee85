// From the writer of a sensor port to its reader, in two processes: images of 640 x 480 at 30 Hz, in numbers of 16 bits as depth cameras make them and in
// metres; the reader looks without a pause (a lane looks every 2.5 ms: what it waits is its own). The last lines are JSON.
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <thread>
#include <vector>

#include "platform/sensor_port/port_devices.hpp"

namespace {

using namespace roborun;

constexpr std::uint32_t kWidth = 640, kHeight = 480;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
constexpr const char* kPath = "/dev/shm/roborun-bench";

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec;
}

struct Format {
  const char* name;
  roborun_port_pixel pixel;
  std::uint32_t bytes;  ///< Of a pixel.
};

[[noreturn]] void feed(const Format& format) {
  roborun_port_writer writer;
  const std::uint32_t bytes = kWidth * kHeight * format.bytes;
  if (const char* wrong = roborun_port_open(&writer, kPath, ROBORUN_PORT_DEPTH, bytes, 4); wrong != nullptr) {
    fmt::print(stderr, "{}: {}\n", kPath, wrong);
    _exit(1);
  }
  const std::vector<float> metres(kPixels, 5.0F);
  const std::vector<std::uint16_t> numbers(kPixels, 5000);
  const bool is_float = format.pixel == ROBORUN_PORT_FLOAT32_M;
  const void* pixels = is_float ? static_cast<const void*>(metres.data()) : numbers.data();
  roborun_port_depth image{};
  image.width = kWidth;
  image.height = kHeight;
  image.pixel = format.pixel;
  image.unit_m = 0.001F;
  image.fx = image.fy = 380.0F;
  image.cx = 319.5F;
  image.cy = 239.5F;
  image.range_m = 10.0F;
  image.mount.q_BS[0] = 1.0F;
  for (;;) {
    ++image.at.sequence;
    image.at.stamp_ns = now_ns();
    (void)roborun_port_write(&writer, &image, pixels, bytes);
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  }
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

/// False: the writer did not write.
bool measure(const Format& format, int images) {
  std::remove(kPath);
  const pid_t child = fork();
  if (child == 0) feed(format);
  sensor_port::PortDepthCamera camera;
  for (int i = 0; i < 200 && !camera.open(kPath, {}).empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  (void)mlockall(MCL_CURRENT);
  firmware_if::DepthFrame frame;
  std::vector<double> late_us;
  late_us.reserve(static_cast<std::size_t>(images));
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  for (unsigned look = 1; late_us.size() < static_cast<std::size_t>(images); ++look) {
    if (camera.read(frame) == Status::kOk)
      late_us.push_back(1e-3 * static_cast<double>(now_ns() - frame.stamp.time_since_epoch().count()));
    if (look % 1'000'000 == 0 && waitpid(child, nullptr, WNOHANG) != 0) break;
  }
  getrusage(RUSAGE_SELF, &after);
  kill(child, SIGKILL);
  (void)waitpid(child, nullptr, 0);
  std::remove(kPath);
  if (late_us.empty()) return false;
  std::sort(late_us.begin(), late_us.end());
  const double median_us = quantile(late_us, 0.5), p99_us = quantile(late_us, 0.99);
  fmt::print(
      "{} images of {} x {}, {}: stamp to frame in the reader's memory: median {:.0f} us, p99 {:.0f} us, "
      "most {:.0f} us\n",
      late_us.size(), kWidth, kHeight, format.name, median_us, p99_us, late_us.back());
  fmt::print(
      R"({{"pixel":"{}","images":{},"median_us":{:.1f},"p99_us":{:.1f},"dropped":{},"torn":{},"page_faults":{}}})"
      "\n",
      format.name, late_us.size(), median_us, p99_us, camera.reader().counters().dropped,
      camera.reader().counters().torn, after.ru_minflt - before.ru_minflt);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const int images = argc > 1 ? std::max(std::atoi(argv[1]), 10) : 600;
  const bool all = measure({"uint16", ROBORUN_PORT_UINT16, 2}, images) &&
                   measure({"float32", ROBORUN_PORT_FLOAT32_M, 4}, images);
  return all ? 0 : 1;
}
