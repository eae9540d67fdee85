#include "platform/live/sim_line.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::live {
namespace {

TEST(SimLine, WritesWhatTheKernelUnderstandsAndOnlyChanges) {
  const std::string path = test::scratch("sim_line");
  std::ofstream(path) << "";
  const auto said = [&] {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    std::ofstream(path) << "";
    return text.str();
  };
  SimLine sut("--kill-pulls", path);
  EXPECT_TRUE(sut.pull(true));
  EXPECT_EQ(said(), "pull-up");
  EXPECT_TRUE(sut.pull(true));
  EXPECT_EQ(said(), "");
  EXPECT_TRUE(sut.pull(false));
  EXPECT_EQ(said(), "pull-down");
  std::remove(path.c_str());
}

TEST(SimLine, RefusesAFileThatIsNotThere) {
  try {
    const SimLine sut("--kill-pulls", "/nix/pull");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "--kill-pulls: /nix/pull: No such file or directory: must be the pull of a gpio-sim line");
  }
}

}  // namespace
}  // namespace roborun::live
