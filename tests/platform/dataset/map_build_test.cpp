// Maps of recordings that the simulator's camera made: against the true world, and what the figures say of wrong ones.
#include "platform/dataset/map_build.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "platform/dataset/pose_text.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "tests/platform/dataset/simulated_recording.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::dataset {
namespace {

constexpr double kCell_m = 0.3;
bool always(std::size_t /*frames*/) { return true; }

RecordingOptions options() {
  RecordingOptions o;
  o.range_m = 6.0;
  return o;
}

std::string recording_of(const std::string& name, int frames) {
  std::string folder = test::scratch(name);
  test::SimulatedRecording how;
  how.width = 128;
  how.height = 96;
  how.frames = frames;
  how.rate_Hz = 10.0;
  test::write_recording(folder, test::room(), how);
  return folder;
}

TEST(MapBuild, HoldsTheWorldThatTheImagesShow) {
  Recording recording(recording_of("room", 60), options());
  const MapBuild build = build_map(recording, kCell_m, true, always);
  EXPECT_EQ(build.frames, 60U);
  EXPECT_EQ(build.frames_refused, 0U);
  EXPECT_GT(build.bytes, 1000U);
  EXPECT_GT(build.ms_median, 0.0);
  EXPECT_GE(build.ms_p99, build.ms_median);
  EXPECT_LT(build.agreement.false_free_ratio(), 0.001);
  EXPECT_LT(build.agreement.false_occupied_ratio(), 0.01);
  // What comes into view for the first time is missed, too: at 0.05 m an image a strip of it.
  EXPECT_LT(build.agreement.missed_ratio(), 0.1);
  ASSERT_GT(build.agreement.surface_pixels, 100'000U);
  ASSERT_GT(build.agreement.occupied_shown, 1000U);
  // Cells of the file against the room: free ones are free in their middle, occupied ones have a surface near.
  const sitl::World room = test::room();
  std::size_t free = 0, occupied = 0;
  for (const sitl::OctomapLeaf& leaf : build.leaves.leaves) {
    const auto cell = sitl::octomap_cell(leaf.morton);
    const Vector3 middle_W =
        kCell_m * (Vector3(cell[0], cell[1], cell[2]) + Vector3::Constant(0.5 * leaf.size - 32768.0));
    const bool solid = room.clearance_m(middle_W, 1.0) <= 0.0 || middle_W.z() < 0.0;
    if (leaf.occupied) {
      ++occupied;
      EXPECT_LT(std::min(room.clearance_m(middle_W, 1.0), std::max(middle_W.z(), 0.0)), 0.6)
          << middle_W.transpose();
    } else {
      ++free;
      EXPECT_FALSE(solid) << middle_W.transpose();
    }
  }
  EXPECT_GT(free, 100U);
  EXPECT_GT(occupied, 100U);
  EXPECT_FALSE(sitl::write_octomap(build.leaves, false).empty());
}

TEST(MapBuild, IsTheSameEachTime) {
  const std::string folder = recording_of("again", 12);
  Recording one(folder, options()), two(folder, options());
  const MapBuild first = build_map(one, kCell_m, true, always),
                 second = build_map(two, kCell_m, true, always);
  EXPECT_EQ(sitl::write_octomap(first.leaves, false), sitl::write_octomap(second.leaves, false));
  EXPECT_EQ(first.agreement.in_free, second.agreement.in_free);
  EXPECT_EQ(first.bytes, second.bytes);
}

/// The figures of a recording in which, from image `from` on, all is believed to be `by_m` farther along y, where the camera looks.
Agreement shifted(const std::string& name, std::size_t from, double by_m) {
  const std::string folder = recording_of(name, 40);
  auto poses = parse_poses(input::read_text(folder + "/groundtruth.txt", "poses"), "groundtruth.txt");
  std::ofstream truth(folder + "/groundtruth.txt");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Quaterniond q(poses[i].X_WS.R_RT);
    const Vector3 p_W = poses[i].X_WS.p_RT + (i < from ? 0.0 : by_m) * Vector3::UnitY();
    truth << fmt::format("{} {} {} {} {} {} {} {}\n", poses[i].time_s, p_W.x(), p_W.y(), p_W.z(), q.x(),
                         q.y(), q.z(), q.w());
  }
  truth.close();
  Recording recording(folder, options());
  return build_map(recording, kCell_m, false, always).agreement;
}

TEST(MapBuild, WrongPosesAreSeenInTheFigures) {
  const Agreement right = shifted("right", 20, 0.0);
  const Agreement back = shifted("back", 20, -1.0);   // surfaces come to stand where free space was seen
  const Agreement ahead = shifted("ahead", 20, 1.0);  // and behind surfaces that are seen past
  EXPECT_GT(back.false_free_ratio(), right.false_free_ratio() + 0.005);
  EXPECT_GT(back.missed_ratio(), right.missed_ratio() + 0.005);
  EXPECT_GT(ahead.false_occupied_ratio(), right.false_occupied_ratio() + 0.005);
  EXPECT_GT(ahead.missed_ratio(), right.missed_ratio() + 0.005);
}

TEST(MapBuild, OneImageAgreesWithNone) {
  Recording recording(recording_of("one", 1), options());
  const MapBuild build = build_map(recording, kCell_m, false, always);
  EXPECT_EQ(build.frames, 1U);
  EXPECT_EQ(build.agreement.surface_pixels, 0U);
  EXPECT_TRUE(std::isnan(build.agreement.missed_ratio()));
}

TEST(MapBuild, RefusesWhatNoMapCanHold) {
  const std::string folder = recording_of("far", 2);
  std::ofstream(folder + "/groundtruth.txt") << "100 0 0 1 0 0 0 1\n100.1 90000 0 1 0 0 0 1\n";
  Recording recording(folder, options());
  EXPECT_THROW((void)build_map(recording, kCell_m, false, always), InputError);
}

TEST(MapBuild, RefusesImagesWithoutAnyDepth) {
  const std::string folder = recording_of("black", 2);
  for (const char* name : {"/depth/00000.png", "/depth/00001.png"})
    test::write_png(folder + name, 128, 96, 16, std::vector<std::uint16_t>(std::size_t{128} * 96, 0));
  Recording recording(folder, options());
  try {
    (void)build_map(recording, kCell_m, false, always);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("none of 2 frames was believed"), std::string::npos);
  }
}

TEST(MapBuild, EndsWhenItIsTold) {
  Recording recording(recording_of("stop", 10), options());
  const MapBuild build = build_map(recording, kCell_m, false, [](std::size_t frames) { return frames < 4; });
  EXPECT_EQ(build.frames, 4U);
}

}  // namespace
}  // namespace roborun::dataset
