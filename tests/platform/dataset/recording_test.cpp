// What a folder of recorded images or clouds may hold, and what is said of a bad one.
#include "platform/dataset/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "core/random/counter_rng.hpp"
#include "platform/dataset/depth_png.hpp"
#include "platform/dataset/pose_text.hpp"
#include "platform/input/input_error.hpp"
#include "tests/platform/dataset/simulated_recording.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::dataset {
namespace {

constexpr std::size_t kWidth = 32, kHeight = 24;

/// A folder with `frames` images of one depth, and what else is in `files`.
std::string folder_of(const std::string& name, int frames,
                      const std::vector<std::pair<std::string, std::string>>& files,
                      std::uint16_t value = 2000) {
  std::string folder = test::scratch(name);
  std::filesystem::create_directories(folder);
  for (int i = 0; i < frames; ++i)
    test::write_png(folder + "/" + std::to_string(i) + ".png", kWidth, kHeight, 16,
                    std::vector<std::uint16_t>(kWidth * kHeight, value));
  for (const auto& [file, text] : files) std::ofstream(std::filesystem::path(folder) / file) << text;
  return folder;
}
const std::string kOptics = "20 20 15.5 11.5 1000\n";
const std::string kLine = "0 1 2 3 0 0 0 1\n";

std::string complaint(const std::function<void()>& work) {
  try {
    work();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "no complaint";
}
std::string complaint_of(const std::string& folder, const RecordingOptions& options = {}) {
  return complaint([&] {
    Recording recording(folder, options);
    for (std::size_t i = 0; i < recording.size(); ++i) (void)recording.load(i);
  });
}
#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(Recording, ReadsNumberedImagesInTheOrderOfTheirNumbers) {
  const std::string folder = folder_of("numbered", 11, {{"camera.txt", kOptics}});
  std::ofstream poses(folder + "/poses.txt");
  for (int i = 0; i < 11; ++i) poses << "0 " << i << " 0 0 0 0 0 1\n";
  poses.close();
  Recording recording(folder, {});
  ASSERT_EQ(recording.size(), 11U);
  for (std::size_t i = 0; i < 11; ++i)
    EXPECT_EQ(recording.load(i).front().X_WC.p_RT.x(), static_cast<double>(i));
  const stages::PosedDepthFrame& posed = recording.load(10).front();
  EXPECT_EQ(posed.frame.width, kWidth);
  EXPECT_EQ(posed.frame.height, kHeight);
  EXPECT_FLOAT_EQ(posed.frame.tan_half_width, 0.8F);  // 16 pixels of 20
  EXPECT_FLOAT_EQ(posed.frame.depth_m[5], 2.0F);
  // The identity: their z, forward, is the world's; so our x is the world's z, our z minus its y.
  EXPECT_TRUE(posed.X_WC.R_RT.col(0).isApprox(Vector3::UnitZ()));
  EXPECT_TRUE(posed.X_WC.R_RT.col(2).isApprox(-Vector3::UnitY()));
}

TEST(Recording, CutsWhatIsNotAboutThePrincipalPoint) {
  // Principal point 2 pixels left of and 1.5 above the middle: 4 columns on the right and 3 rows below go.
  const std::string folder =
      folder_of("cut", 1, {{"poses.txt", kLine}, {"camera.txt", "20 20 13.5 10 1000\n"}});
  std::vector<std::uint16_t> value(kWidth * kHeight, 1000);
  value[0] = 3000;
  value[kWidth * 20 + 27] = 4000;  // the last that stays
  test::write_png(folder + "/0.png", kWidth, kHeight, 16, value);
  Recording recording(folder, {});
  const firmware_if::DepthFrame& frame = recording.load(0).front().frame;
  ASSERT_EQ(frame.width, 28);
  ASSERT_EQ(frame.height, 21);
  EXPECT_FLOAT_EQ(frame.tan_half_width, 0.7F);
  EXPECT_FLOAT_EQ(frame.depth_m[0], 3.0F);
  EXPECT_FLOAT_EQ(frame.depth_m.back(), 4.0F);
}

TEST(Recording, AZeroIsNoValue) {
  const std::string folder = folder_of("zero", 1, {{"poses.txt", kLine}, {"camera.txt", kOptics}}, 0);
  Recording recording(folder, {});
  EXPECT_TRUE(std::isnan(recording.load(0).front().frame.depth_m[7]));
}

TEST(Recording, FindsThePosesOfAssociatedImages) {
  const std::string folder =
      folder_of("tum", 4,
                {{"camera.txt", kOptics},
                 {"depth.txt", "# time file\n9 0.png\n10 1.png\n10.05 2.png\n11.05 3.png\n"},
                 {"groundtruth.txt",
                  "# time tx ty tz qx qy qz qw\n10 0 0 0 0 0 0 1\n10.1 1 0 0 0 0 0.70710678 0.70710678\n12 2 "
                  "0 0 0 0 0 1\n"}});
  Recording recording(folder, {});
  ASSERT_EQ(recording.size(), 2U);
  EXPECT_EQ(recording.left_out(), 2U);  // before the first pose, and between two that are 1.9 s apart
  EXPECT_EQ(recording.load(0).front().X_WC.p_RT.x(), 0.0);
  const Pose X_WC = recording.load(1).front().X_WC;
  EXPECT_NEAR(X_WC.p_RT.x(), 0.5, 1e-6);
  // Half of a quarter turn about z: their x axis, minus our y, is (1, 1, 0) / sqrt 2.
  EXPECT_TRUE((-X_WC.R_RT.col(1)).isApprox(Vector3(std::sqrt(0.5), std::sqrt(0.5), 0.0), 1e-6));
}

TEST(Recording, ReadsMatrices) {
  const auto poses =
      parse_poses("1 0 0 4  0 0 -1 5  0 1 0 6\n\n# 16\n1 0 0 7 0 1 0 8 0 0 1 9 0 0 0 1\n", "poses.txt");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_TRUE(poses[0].X_WS.p_RT.isApprox(Vector3(4, 5, 6)));
  EXPECT_TRUE(poses[0].X_WS.R_RT.col(1).isApprox(Vector3::UnitZ(), 1e-9));
  EXPECT_TRUE(poses[1].X_WS.p_RT.isApprox(Vector3(7, 8, 9)));
}

TEST(Recording, RefusesBadPoses) {
  const auto of = [](const std::string& text) {
    return complaint([&] { (void)parse_poses(text, "poses.txt"); });
  };
  EXPECT_SAYS(of(kLine + "0 1 2 3 0 nan 0 1\n"), "poses.txt:2: 'nan': must be a finite number");
  EXPECT_SAYS(of("0 1 2 3 0 0 0 0\n"), "poses.txt:1: quaternion qx qy qz qw: must have the length 1");
  EXPECT_SAYS(of("0 1 2 3 0 0 0 1.5\n"), "must have the length 1");
  EXPECT_SAYS(of("0 1 2 3\n"), "poses.txt:1: 4 numbers: must be 8");
  EXPECT_SAYS(of("0 1 2 3 0 0 0 1 5 5 5 5 5 5 5 5 5 5\n"), "18 numbers");
  EXPECT_SAYS(of("0 1 2 3 0 0 0 one\n"), "'one': must be a finite number");
  EXPECT_SAYS(of("1 0 0 0 0 2 0 0 0 0 1 0\n"), "matrix: must be a rotation");
  EXPECT_SAYS(of("1 0 0 0 0 1 0 0 0 0 -1 0\n"), "matrix: must be a rotation");
}

TEST(Recording, RefusesAFolderThatIsNoRecording) {
  EXPECT_SAYS(complaint_of("/nope/nothing"), "/nope/nothing: must be a folder");
  EXPECT_SAYS(complaint_of(folder_of("empty", 0, {{"poses.txt", kLine}})), "no frames: must hold depth.txt");
  EXPECT_SAYS(complaint_of(folder_of("no poses", 1, {{"camera.txt", kOptics}})),
              "poses.txt: cannot be opened: must be");
  EXPECT_SAYS(complaint_of(folder_of("comment", 1, {{"poses.txt", "# none\n"}})), "poses.txt: no pose");
  EXPECT_SAYS(complaint_of(folder_of("few", 3, {{"poses.txt", kLine + kLine}, {"camera.txt", kOptics}})),
              "2 poses for 3 files: must have a line for each");
  EXPECT_SAYS(complaint_of(folder_of("optics", 1, {{"poses.txt", kLine}})), "camera.txt: cannot be opened");
  EXPECT_SAYS(
      complaint_of(folder_of("optics2", 1, {{"poses.txt", kLine}, {"camera.txt", "20 20 15 inf 1000"}})),
      "camera.txt: 'inf': must be five numbers above 0");
  EXPECT_SAYS(
      complaint_of(folder_of("optics3", 1, {{"poses.txt", kLine}, {"camera.txt", "20 20 300 11 1000"}})),
      "must be at most 126 degrees wide and 8 pixels or more");
  EXPECT_SAYS(complaint_of(folder_of("mixed", 1, {{"poses.txt", kLine}, {"a.pcd", ""}})),
              "must hold files of one kind");
}

TEST(Recording, RefusesTimesThatDoNotMatch) {
  const auto tum = [](const std::string& name, const std::string& depth, const std::string& truth) {
    return complaint_of(
        folder_of(name, 1, {{"camera.txt", kOptics}, {"depth.txt", depth}, {"groundtruth.txt", truth}}));
  };
  const std::string truth = "10 0 0 0 0 0 0 1\n10.1 1 0 0 0 0 0 1\n";
  EXPECT_SAYS(tum("t1", "1305031102.1 0.png\n", truth), "none of its times is that of a pose");
  EXPECT_SAYS(tum("t2", "# nothing\n", truth), "depth.txt: no image");
  EXPECT_SAYS(tum("t3", "10.05 0.png\n10.01 0.png\n", truth),
              "depth.txt:2: 10.01 s after 10.05 s: times must ascend");
  EXPECT_SAYS(tum("t4", "10.05\n", truth), "depth.txt:1: must be a time and a file");
  EXPECT_SAYS(tum("t5", "10.05 0.png\n", "11 0 0 0 0 0 0 1\n10 0 0 0 0 0 0 1\n"), "times must ascend");
  EXPECT_SAYS(tum("t6", "10.05 9.png\n", truth), "9.png: cannot be opened");
}

TEST(Recording, RefusesImagesOfAnotherKind) {
  const std::string folder = folder_of("kinds", 2, {{"poses.txt", kLine + kLine}, {"camera.txt", kOptics}});
  ASSERT_EQ(complaint_of(folder), "no complaint");
  const std::vector<std::uint16_t> value(kWidth * kHeight, 100);
  test::write_png(folder + "/1.png", kWidth, kHeight, 8, value);
  EXPECT_SAYS(complaint_of(folder), "1.png: 8 bits in 1 channel: must be 16 bits in one");
  test::write_png(folder + "/1.png", kWidth / 2, kHeight, 16, value);
  EXPECT_SAYS(complaint_of(folder), "1.png: 16 x 24 pixels: must be 32 x 24, as ");
  test::write_png(folder + "/1.png", 4, kHeight, 16, value);
  EXPECT_SAYS(complaint_of(folder), "1.png: 4 x 24 pixels: must be 8 to 1280 a side");
  std::ofstream(folder + "/1.png", std::ios::trunc) << "GIF89a";
  EXPECT_SAYS(complaint_of(folder), "1.png: ");
  EXPECT_SAYS(complaint_of(folder), "must be a whole PNG file");
}

TEST(Recording, RefusesEachTruncationOfAnImage) {
  const std::string path = test::scratch("whole.png");
  std::vector<std::uint16_t> value;
  for (std::size_t i = 0; i < kWidth * kHeight; ++i)
    value.push_back(static_cast<std::uint16_t>(core::mix64(i)));
  test::write_png(path, kWidth, kHeight, 16, value);
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::span<const unsigned char> bytes(reinterpret_cast<const unsigned char*>(text.data()),
                                             text.size());
  ASSERT_EQ(parse_depth_png(bytes, "whole.png").value, value);
  ASSERT_GT(bytes.size(), 500U);
  for (std::size_t end = 0; end < bytes.size(); ++end)
    EXPECT_THROW((void)parse_depth_png(bytes.first(end), "cut.png"), InputError) << end;
  // A bit that tips over is met by a checksum.
  std::vector<unsigned char> broken(bytes.begin(), bytes.end());
  broken[200] ^= 16U;
  EXPECT_THROW((void)parse_depth_png(broken, "broken.png"), InputError);
}

/// Points of a ball seen from its middle: rings and columns of steps of so many degrees.
std::vector<std::array<float, 3>> ball(double ring_deg, double column_deg) {
  std::vector<std::array<float, 3>> points;
  for (double ring = -60.0; ring <= 60.0; ring += ring_deg)
    for (double column = 0.0; column < 360.0; column += column_deg) {
      const double a = ring * 3.14159265 / 180.0, b = column * 3.14159265 / 180.0;
      points.push_back({static_cast<float>(5.0 * std::cos(a) * std::cos(b)),
                        static_cast<float>(5.0 * std::cos(a) * std::sin(b)),
                        static_cast<float>(5.0 * std::sin(a))});
    }
  return points;
}

TEST(Recording, PixelsFollowTheCloudsDensity) {
  // A pixel of an image of 32 is 3.6 degrees wide in the middle and 1.8 in the corners, of 64 the half.
  EXPECT_EQ(cloud_image_pixels(ball(2.0, 2.0)), 32);
  EXPECT_EQ(cloud_image_pixels(ball(1.0, 1.0)), 64);
  EXPECT_EQ(cloud_image_pixels(ball(0.25, 0.25)), 256);
  EXPECT_EQ(cloud_image_pixels(ball(4.0, 0.1)),
            16);  // rings are far apart: as fine as they, not as the columns
  EXPECT_EQ(cloud_image_pixels({}), 8);
}

TEST(Recording, ReadsClouds) {
  std::string pcd =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA "
      "ascii\n";
  const std::string folder = folder_of("clouds", 0,
                                       {{"0.pcd", pcd + "5 0.1 0.2\n5 -0.1 0\n-4 0 0\n"},
                                        {"1.pcd", pcd + "nan 0 0\n0 0 0\n5 5 5\n"},
                                        {"poses.txt", "0 1 2 3 0 0 0 1\n0 1 2 4 0 0 0 1\n"}});
  Recording recording(folder, {});
  EXPECT_TRUE(recording.has_clouds());
  ASSERT_EQ(recording.size(), 2U);
  const auto frames = recording.load(0);
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_TRUE(frames[0].X_WC.p_RT.isApprox(Vector3(1, 2, 3)));
  EXPECT_FLOAT_EQ(frames[0].frame.depth_m[(4 - 1) * 8 + 3], 5.0F);
  EXPECT_EQ(recording.load(1).size(), 6U);
  std::ofstream(folder + "/1.pcd") << pcd << "nan 0 0\n0 0 0\n0 nan 0\n";
  EXPECT_SAYS(complaint_of(folder), "1.pcd: no point");
  std::ofstream(folder + "/1.pcd") << pcd << "1 0 0\n";
  EXPECT_SAYS(complaint_of(folder), "1.pcd: ");
}

}  // namespace
}  // namespace roborun::dataset
