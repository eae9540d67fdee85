#include "platform/rt/idle_latency.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace roborun::rt {
namespace {

constexpr const char* kDevice = "/dev/cpu_dma_latency";

/// Files of this process open on the device: the kernel takes a request back when its file is closed.
int requests() {
  int count = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    count += std::filesystem::read_symlink(entry.path(), error) == kDevice ? 1 : 0;
  return count;
}

TEST(IdleLatencyHold, HoldsTheKernelAtZeroWhileItLivesOrSaysWhyNot) {
  {
    const IdleLatencyHold hold;
    std::ifstream device(kDevice, std::ios::binary);
    std::int32_t granted_us = -1;
    if (hold.describe() == "held at 0 us") {
      ASSERT_TRUE(device.read(reinterpret_cast<char*>(&granted_us), sizeof granted_us));
      EXPECT_EQ(granted_us, 0);
    } else {
      EXPECT_FALSE(std::ofstream(kDevice).is_open());
      EXPECT_NE(hold.describe().find("/dev/cpu_dma_latency: "), std::string::npos) << hold.describe();
    }
  }
  EXPECT_EQ(requests(), 0);
}

}  // namespace
}  // namespace roborun::rt
