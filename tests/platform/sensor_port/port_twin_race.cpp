/// Not a test of ours but of the check: under ThreadSanitizer this program must be reported. Its writer keeps the guard, and copies as anybody would.
#include <atomic>
#include <thread>
#include <vector>

#include "tests/platform/sensor_port/one_mapping.hpp"

int main(int argc, char** argv) {
  using namespace roborun;
  using namespace roborun::sensor_port;
  if (argc != 2) return 2;
  roborun_port_writer writer;
  PortReader reader;
  constexpr std::uint32_t kBytes = 4096;
  const std::vector<std::byte> payload(kBytes);
  roborun_port_imu sample{};
  if (roborun_port_open(&writer, argv[1], ROBORUN_PORT_IMU, kBytes, 2) != nullptr ||
      !reader.open(argv[1], ROBORUN_PORT_IMU).empty())
    return 2;
  (void)roborun_port_write(&writer, &sample, payload.data(), kBytes);
  {
    const OneMapping one(writer, reader);
    if (!one.is_one()) return 2;
    std::atomic<bool> done{false};
    std::thread thread([&] {
      auto* at = reinterpret_cast<std::byte*>(writer.header + 1);
      auto* guard = &reinterpret_cast<roborun_port_slot*>(at)->guard;
      for (std::uint64_t n = 2; !done.load(std::memory_order_relaxed); n += 2) {
        __atomic_store_n(guard, 2 * n + 1, __ATOMIC_RELEASE);
        for (std::uint32_t i = 0; i < kBytes; ++i)
          at[sizeof(roborun_port_slot) + sizeof sample + i] = payload[i];
        __atomic_store_n(guard, 2 * n + 2, __ATOMIC_RELEASE);
        __atomic_store_n(&writer.header->written, n + 1, __ATOMIC_RELEASE);
        std::this_thread::yield();
      }
    });
    PortSample out;
    for (int taken = 0; taken < 2000; std::this_thread::yield())
      taken += reader.newest(out) == Status::kOk ? 1 : 0;
    done.store(true, std::memory_order_relaxed);
    thread.join();
  }
  roborun_port_close(&writer);
  return 0;
}
