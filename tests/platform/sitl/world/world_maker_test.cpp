#include "platform/sitl/world/world_maker.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sitl {
namespace {

TEST(WorldMaker, TheSameSeedIsTheSameFileAndAnotherSeedIsNot) {
  for (const std::string_view name : kWorldKindName) {
    const WorldKind kind = world_kind_of(std::string(name));
    const auto text = [kind](std::uint64_t seed) { return world_toml(make_world(kind, seed, {}), "x"); };
    EXPECT_EQ(text(5), text(5)) << name;
    EXPECT_NE(text(5), text(6)) << name;
  }
}

TEST(WorldMaker, EveryKindIsReadBackAsItWasMade) {
  for (const std::string_view name : kWorldKindName) {
    for (const bool closed : {false, true}) {
      WorldMakerOptions options;
      options.closed = closed;
      const WorldDescription made = make_world(world_kind_of(std::string(name)), 3, options);
      // Start and goal are free, inside, and over ground, or this would throw.
      const World read = load_world(test::scratch_file("made.toml", world_toml(made, "x")), {});
      ASSERT_EQ(read.boxes().size(), made.boxes.size()) << name;
      ASSERT_EQ(read.pillars().size(), made.pillars.size()) << name;
      ASSERT_GT(read.boxes().size() + read.pillars().size(), 0U) << name;
      for (std::size_t i = 0; i < made.boxes.size(); ++i)
        EXPECT_EQ(read.boxes()[i].max_W, made.boxes[i].max_W);
      EXPECT_EQ(read.goal_W(), made.goal_W);
    }
  }
}

TEST(WorldMaker, RefusesOptionsThatAreOutOfRangeOrOfNoUse) {
  WorldMakerOptions options;
  options.width_m = 3.0;
  EXPECT_THROW((void)make_world(WorldKind::kForest, 1, options), InputError);
  EXPECT_NO_THROW((void)make_world(WorldKind::kMaze, 1, options));
  options.width_m = -1.0;
  EXPECT_THROW((void)make_world(WorldKind::kMaze, 1, options), InputError);
  options = {};
  options.spacing_m = 1e-9;
  EXPECT_THROW((void)make_world(WorldKind::kForest, 1, options), InputError);
  EXPECT_THROW((void)world_kind_of("jungle"), InputError);
}

}  // namespace
}  // namespace roborun::sitl
