#include <gtest/gtest.h>

#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/board/shipped_boards.hpp"
#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::board {
namespace {

TEST(HostProfile, RefusesAMalformedFile) {
  std::string note;
  for (const char* text : {"", "x = 1\n", "[board]\nper_unit_s = [1, 2]\n", "\xff\xfe"}) {
    EXPECT_THROW((void)host(test::scratch_file("bad_host.toml", text), {}, 1.0, note), InputError) << text;
  }
}

constexpr std::size_t kMapStage = static_cast<std::size_t>(core::StageId::kMap);

TEST(BoardProfile, TakesTheShippedBoardAsManyTimesAsItsFileSays) {
  const BoardProfile board = board_from_toml("cortex-a72", kCortexA72);
  ASSERT_GT(board.factor, 1.0);
  ASSERT_GT(board.per_unit_s[kMapStage], 0.0);
  const Profile profile = load_profile("cortex-a72", {});
  EXPECT_DOUBLE_EQ(profile.costs.stage[kMapStage].per_unit_s, board.factor * board.per_unit_s[kMapStage]);
  EXPECT_DOUBLE_EQ(profile.model[0].fixed_s[0], board.factor * board.stage[0].p99.fixed_s[0]);
  const BoardProfile back = board_from_toml("back", to_toml(board));
  EXPECT_EQ(back.factor, board.factor);
  EXPECT_EQ(back.backends, board.backends);
}

TEST(BoardProfile, ChargesOtherLibrariesByVolumeAndTheOwnStagesByTheirWork) {
  core::Work work;
  work.units = 1'000'000;
  const Profile stock = load_profile("cortex-a72", {"octomap", "ompl:RRTstar"});
  const Profile own = load_profile("cortex-a72", {});
  const BoardProfile board = board_from_toml("stock", kCortexA72Stock);
  for (const core::StageId id : {core::StageId::kMap, core::StageId::kExport, core::StageId::kPlanner}) {
    work.volume_m3 = 0.0;
    const Nanos none = stock.costs.cost(id, work);
    EXPECT_GT(own.costs.cost(id, work), own.costs.cost(id, {}));
    EXPECT_EQ(none, stock.costs.cost(id, {})) << "what it counts does not matter";
    work.volume_m3 = 1e4;
    EXPECT_GE(stock.costs.cost(id, work), none);
    EXPECT_EQ(stock.costs.of(id).per_unit_s, 0.0);
  }
  EXPECT_NEAR(seconds(stock.costs.cost(core::StageId::kMap, work)),
              board.factor * board.stage[0].mean.latency_s(0, 1e4), 1e-9);
  EXPECT_GT(stock.costs.of(core::StageId::kSmoother).per_unit_s, 0.0) << "our own, whatever the planner";
}

TEST(BoardProfile, RefusesTheCostsOfOtherBackendsAndAFactorOutOfRange) {
  EXPECT_THROW((void)load_profile("cortex-a72", {"octomap", "own"}), InputError);
  const std::string own = test::scratch_file("own.toml", kCortexA72);
  EXPECT_NO_THROW((void)load_profile(own, {}));
  EXPECT_THROW((void)load_profile(own, {"octomap", "ompl:RRTstar"}), InputError);
  EXPECT_NE(default_host_path({}), default_host_path({"octomap", "ompl:RRTstar"}));
  std::string zero = kCortexA72;
  zero.replace(zero.find("factor = 3"), 10, "factor = 0");
  EXPECT_THROW((void)board_from_toml("zero", zero), InputError);
}

}  // namespace
}  // namespace roborun::board
