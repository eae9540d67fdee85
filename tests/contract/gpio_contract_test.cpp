/// The contract of firmware_if::GpioInput and GpioOutput.
/// ROBORUN_TEST_GPIO=LINE (a name or CHIP:OFFSET, idle low) adds a kernel line; without it only the simulated
/// one runs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "platform/gpio/gpiod_line.hpp"
#include "platform/sitl/bus/fake_gpio.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::firmware_if {
namespace {

std::vector<std::string> implementations() {
  std::vector<std::string> out{"fake"};
  if (const char* line = std::getenv("ROBORUN_TEST_GPIO"); line != nullptr) out.emplace_back(line);
  return out;
}

class GpioInputContract : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "fake") {
      input_ = std::make_unique<sitl::FakeGpioInput>();
    } else {
      auto line = std::make_unique<gpio::GpiodInput>();
      ASSERT_EQ(line->open({.name = GetParam()}), "");
      input_ = std::move(line);
    }
  }
  std::unique_ptr<GpioInput> input_;
};

TEST_P(GpioInputContract, ReadsALevelAndHasNoEdgeAtFirst) {
  auto level = input_->active();
  ASSERT_TRUE(level.ok());
  EXPECT_FALSE(level.value());
  GpioEdge edge;
  EXPECT_EQ(input_->next_edge(edge), Status::kNotReady);
}

TEST_P(GpioInputContract, DoesNotAllocate) {
  GpioEdge edge;
  const test::NoAllocScope scope;
  EXPECT_TRUE(input_->active().ok());
  (void)input_->next_edge(edge);
  EXPECT_EQ(scope.count(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Implementations, GpioInputContract, testing::ValuesIn(implementations()),
                         [](const auto& made) {
                           return std::string(made.param == "fake" ? "fake" : "kernel");
                         });

TEST(FakeGpio, KeepsTheNewestSixteenEdges) {
  sitl::FakeGpioInput sut;
  for (int i = 1; i <= 40; ++i) sut.drive(i % 2 == 1, MonotonicTime{Nanos{i}});
  GpioEdge edge;
  int edges = 0;
  for (; sut.next_edge(edge) == Status::kOk; ++edges) EXPECT_EQ(edge.stamp, MonotonicTime{Nanos{25 + edges}});
  EXPECT_EQ(edges, 16);
  EXPECT_FALSE(sut.active().value());
  sut.remove();
  EXPECT_EQ(sut.active().status(), Status::kIo);
}

TEST(GpiodLine, NamesTheLineThatIsNotThere) {
  gpio::GpiodInput input;
  EXPECT_NE(input.open({.name = "no_such_line"}).find("'no_such_line'"), std::string::npos);
  EXPECT_EQ(input.active().status(), Status::kIo);
  gpio::GpiodOutput output;
  EXPECT_NE(output.open({.name = "nochip:3"}).find("'nochip:3'"), std::string::npos);
  EXPECT_NE(output.open({.name = "nochip:x"}).find("CHIP:OFFSET"), std::string::npos);
  EXPECT_EQ(output.set(true), Status::kIo);
}

TEST(GpiodLine, IsRefusedToASecondOwnerByName) {
  const char* name = std::getenv("ROBORUN_TEST_GPIO");
  if (name == nullptr) GTEST_SKIP() << "no kernel line: ROBORUN_TEST_GPIO is not set";
  gpio::GpiodInput first;
  ASSERT_EQ(first.open({.name = name}), "");
  gpio::GpiodInput second;
  EXPECT_NE(second.open({.name = name}).find("busy, used by 'roborun'"), std::string::npos);
}

}  // namespace
}  // namespace roborun::firmware_if
