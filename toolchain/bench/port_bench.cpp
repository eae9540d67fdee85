// From the writer of a sensor port to its reader, in two processes: images of 640 x 480 at 30 Hz; the reader looks every 100 us, as a lane of 400 Hz
// looks every 2.5 ms. The last line is JSON.
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
constexpr const char* kPath = "/dev/shm/roborun-bench";

std::int64_t now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec;
}

[[noreturn]] void feed() {
  roborun_port_writer writer;
  if (const char* wrong = roborun_port_open(&writer, kPath, ROBORUN_PORT_DEPTH, kWidth * kHeight * 4, 4);
      wrong != nullptr) {
    fmt::print(stderr, "{}: {}\n", kPath, wrong);
    _exit(1);
  }
  const std::vector<float> pixels(kWidth * kHeight, 5.0F);
  roborun_port_depth image{};
  image.width = kWidth;
  image.height = kHeight;
  image.pixel = ROBORUN_PORT_FLOAT32_M;
  image.fx = image.fy = 380.0F;
  image.cx = 319.5F;
  image.cy = 239.5F;
  image.range_m = 10.0F;
  image.mount.q_BS[0] = 1.0F;
  for (;;) {
    ++image.at.sequence;
    image.at.stamp_ns = now_ns();
    (void)roborun_port_write(&writer, &image, pixels.data(), kWidth * kHeight * 4);
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  }
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) {
  const int images = argc > 1 ? std::max(std::atoi(argv[1]), 10) : 300;
  std::remove(kPath);
  const pid_t child = fork();
  if (child == 0) feed();
  sensor_port::PortDepthCamera camera;
  for (int i = 0; i < 200 && !camera.open(kPath, {}).empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  (void)mlockall(MCL_CURRENT);
  firmware_if::DepthFrame frame;
  std::vector<double> late_us;
  late_us.reserve(static_cast<std::size_t>(images));
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  while (late_us.size() < static_cast<std::size_t>(images) && waitpid(child, nullptr, WNOHANG) == 0) {
    if (camera.read(frame) == Status::kOk)
      late_us.push_back(1e-3 * static_cast<double>(now_ns() - frame.stamp.time_since_epoch().count()));
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  getrusage(RUSAGE_SELF, &after);
  kill(child, SIGKILL);
  std::remove(kPath);
  if (late_us.empty()) return 1;
  std::sort(late_us.begin(), late_us.end());
  fmt::print(
      "{} images of {} x {}, stamp to frame in the reader's memory: median {:.0f} us, p99 {:.0f} us, most "
      "{:.0f} us\n",
      late_us.size(), kWidth, kHeight, quantile(late_us, 0.5), quantile(late_us, 0.99), late_us.back());
  fmt::print(R"({{"images":{},"median_us":{:.1f},"p99_us":{:.1f},"dropped":{},"torn":{},"page_faults":{}}})"
             "\n",
             late_us.size(), quantile(late_us, 0.5), quantile(late_us, 0.99),
             camera.reader().counters().dropped, camera.reader().counters().torn,
             after.ru_minflt - before.ru_minflt);
  return 0;
}
