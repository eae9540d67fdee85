#include "platform/board/board_profile.hpp"

#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace roborun::board {
namespace {

TEST(HostProfile, IsMeasuredOnceAndRepeatsFromItsFile) {
  const std::string path = test::scratch("host.toml");
  std::string note;
  const Profile first = host(path, {}, 1.0, note);
  EXPECT_NE(note, "") << "says that it measured and where it wrote";
  note.clear();
  const Profile again = host(path, {}, 1.0, note);
  EXPECT_EQ(note, "");
  const Profile slower = host(path, {}, 2.0, note);
  for (int level = 0; level < kPrecisionLevels; ++level) {
    core::Work work;
    work.level = level;
    work.units = 1000;
    work.volume_m3 = 1000.0;
    for (const core::StageId id : {core::StageId::kMap, core::StageId::kExport, core::StageId::kPlanner}) {
      EXPECT_EQ(first.costs.cost(id, work), again.costs.cost(id, work));
      EXPECT_NEAR(static_cast<double>(slower.costs.cost(id, work).count()),
                  2.0 * static_cast<double>(first.costs.cost(id, work).count()), 2.0);
    }
  }
}

}  // namespace
}  // namespace roborun::board
