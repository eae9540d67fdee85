#include "platform/sensor_port/port_bridge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sensor_port {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr Nanos kStep{250'000};
constexpr std::size_t kPixels = 96 * 96;

/// What a network does to datagrams.
struct Network {
  double loss{0.0}, twice{0.0};
  Nanos delay{0}, jitter{0};
};

/// Two machines in virtual time: ports are written on the first one and read on the second one, whose clock stands `apart` from the first one's and is
/// `drift` faster.
template <typename T>
T sample_of(const PortSample& port) {
  T sample;
  EXPECT_EQ(port.sample.size(), sizeof sample);
  std::memcpy(&sample, port.sample.data(), sizeof sample);
  return sample;
}

class PortBridgeTest : public ::testing::Test {
 protected:
  PortBridgeTest() : here_(test::scratch("here")), there_(test::scratch("there")) {
    for (const auto& entry : std::filesystem::directory_iterator(test::scratch_folder()))
      std::filesystem::remove(entry.path());
    start_share();
    fetch_.emplace(there_, BridgeEnd::kFetches, ++sessions_);
  }
  void start_share() { share_.emplace(here_, BridgeEnd::kShares, ++sessions_); }

  [[nodiscard]] MonotonicTime near_clock() const { return MonotonicTime{now_}; }
  [[nodiscard]] MonotonicTime far_clock() const {
    return MonotonicTime{now_ + apart_ +
                         Nanos{static_cast<std::int64_t>(drift_ * static_cast<double>(now_.count()))}};
  }
  SendDatagram wire(bool to_far) {
    return [this, to_far](std::span<const std::uint8_t> datagram) {
      EXPECT_LE(datagram.size(), kDatagram_bytes);
      ++sent_;
      for (int i = chance() < network_.twice ? 2 : 1; i > 0; --i)
        if (chance() >= network_.loss)
          waiting_.emplace(
              now_ + network_.delay +
                  Nanos{static_cast<std::int64_t>(chance() * static_cast<double>(network_.jitter.count()))},
              std::pair{to_far, Bytes(datagram.begin(), datagram.end())});
    };
  }
  void deliver() {
    while (!waiting_.empty() && waiting_.begin()->first <= now_) {
      const auto [to_far, datagram] = waiting_.begin()->second;
      waiting_.erase(waiting_.begin());
      if (to_far)
        fetch_->take(far_clock(), datagram, wire(false));
      else
        share_->take(near_clock(), datagram, wire(true));
    }
  }
  template <typename EachStep>
  void run_for(Nanos duration, const EachStep& each) {
    for (const Nanos end = now_ + duration; now_ < end; now_ += kStep) {
      each();
      deliver();
      share_->step(near_clock(), wire(true));
      fetch_->step(far_clock(), wire(false));
    }
  }
  void run_for(Nanos duration) {
    run_for(duration, [] {});
  }
  /// Until both ends know each other.
  void meet() {
    run_for(Nanos{2'000'000'000});
    ASSERT_TRUE(fetch_->is_heard(far_clock()) && fetch_->is_matched());
  }
  /// A port that is written on one machine, and read on the other one.
  void connect(const std::string& suffix, std::uint32_t kind, std::size_t most_bytes, PortWriter& port,
               PortReader& reader, bool to_far = true) {
    ASSERT_EQ(port.open((to_far ? here_ : there_) + suffix, kind, most_bytes, most_bytes > 0 ? 4 : 1024), "");
    meet();
    ASSERT_EQ(reader.open((to_far ? there_ : here_) + suffix, kind), "");
  }
  [[nodiscard]] double chance() { return std::uniform_real_distribution<double>{}(random_); }

  void write_imu(PortWriter& port, std::uint32_t sequence) const {
    roborun_port_imu imu{};
    imu.at = {near_clock().time_since_epoch().count(), sequence, 0};
    imu.angular_rate_B_radps[0] = sequence;
    ASSERT_TRUE(port.write(imu));
  }
  /// Between the clock of the reader when the first sample is written and the stamp that it reads; not negative.
  void measure_stamp_error(PortWriter& port, PortReader& reader, Nanos& error) {
    const MonotonicTime true_stamp = far_clock();
    write_imu(port, 1);
    run_for(Nanos{10'000'000});
    PortSample read;
    ASSERT_EQ(reader.next(read), Status::kOk);
    const MonotonicTime stamp{Nanos{sample_of<roborun_port_imu>(read).at.stamp_ns}};
    error = Nanos{std::abs((stamp - true_stamp).count())};
  }
  /// Every pixel says which image it is of.
  void write_image(PortWriter& port, std::uint32_t sequence) const {
    roborun_port_depth depth{};
    depth.at = {near_clock().time_since_epoch().count(), sequence, 0};
    const std::vector<float> pixels(kPixels, static_cast<float>(sequence));
    ASSERT_TRUE(port.write(depth, std::as_bytes(std::span(pixels))));
  }

  std::string here_, there_;
  Nanos now_{5'000'000'000'000}, apart_{-1'234'567'891'011};
  double drift_{50e-6};
  Network network_;
  std::mt19937_64 random_{7};
  std::multimap<Nanos, std::pair<bool, Bytes>> waiting_;
  std::optional<PortBridge> share_, fetch_;
  std::uint32_t sessions_{0};
  std::uint64_t sent_{0};
};

TEST_F(PortBridgeTest, MakesThePortsOfTheOtherMachineAndNotItsTruth) {
  PortWriter imu, camera, truth, out;
  ASSERT_EQ(imu.open(here_ + "-imu", ROBORUN_PORT_IMU, 0, 64), "");
  ASSERT_EQ(camera.open(here_ + "-camera1", ROBORUN_PORT_DEPTH, 4 * kPixels, 4), "");
  ASSERT_EQ(truth.open(here_ + "-truth", ROBORUN_PORT_ODOMETRY, 0, 64), "");
  ASSERT_EQ(out.open(there_ + "-bus-out", ROBORUN_PORT_CAN, 0, 64), "");
  meet();
  PortReader reader;
  EXPECT_EQ(reader.open(there_ + "-imu", ROBORUN_PORT_IMU), "");
  EXPECT_EQ(reader.slot_count(), 64U);
  EXPECT_EQ(reader.open(there_ + "-camera1", ROBORUN_PORT_DEPTH), "");
  EXPECT_GE(reader.payload_room_bytes(), 4 * kPixels);
  EXPECT_EQ(reader.open(here_ + "-bus-out", ROBORUN_PORT_CAN), "");
  EXPECT_FALSE(std::filesystem::exists(there_ + "-truth"));
  EXPECT_EQ(share_->refused() + fetch_->refused(), 0U);
}

TEST_F(PortBridgeTest, LosesNoSampleOfAnImuWhereEveryFifthDatagramIsLost) {
  network_ = {0.2, 0.05, Nanos{1'500'000}, Nanos{2'000'000}};
  PortWriter imu;
  PortReader reader;
  connect("-imu", ROBORUN_PORT_IMU, 0, imu, reader);
  std::uint32_t sequence = 0, got = 0;
  std::int64_t before_ns = 0;
  Nanos written{0};
  const auto each = [&] {
    if (now_ - written >= Nanos{2'500'000}) {
      write_imu(imu, ++sequence);
      written = now_;
    }
    for (PortSample port; reader.next(port) == Status::kOk;) {
      const auto sample = sample_of<roborun_port_imu>(port);
      ASSERT_EQ(sample.at.sequence, ++got);
      ASSERT_EQ(sample.angular_rate_B_radps[0], got);
      ASSERT_GT(sample.at.stamp_ns, before_ns);
      before_ns = sample.at.stamp_ns;
      const Nanos age = far_clock() - MonotonicTime{Nanos{sample.at.stamp_ns}};
      // It waits for the datagrams behind those that were lost; the clocks are known to half of a round trip.
      ASSERT_LT(age, Nanos{30'000'000});
      ASSERT_GT(age, Nanos{0});
    }
  };
  run_for(Nanos{20'000'000'000}, each);
  EXPECT_GE(got + 12, sequence);
  EXPECT_GT(got, 7'900U);
  EXPECT_EQ(fetch_->receiver().counters().lost, 0U);
}

TEST_F(PortBridgeTest, StampsAreOnTheReadersClockWithinWhatItSays) {
  network_ = {0.0, 0.0, Nanos{1'000'000}, Nanos{1'000'000}};
  PortWriter imu;
  PortReader reader;
  connect("-imu", ROBORUN_PORT_IMU, 0, imu, reader);
  run_for(Nanos{2'000'000'000});
  Nanos error{};
  measure_stamp_error(imu, reader, error);
  EXPECT_LT(error, fetch_->clock_error() + kStep);
  EXPECT_LT(fetch_->clock_error(), Nanos{2'000'000});
}

TEST_F(PortBridgeTest, PicturesComeWholeAndInTheirOrderWhereEveryTenthDatagramIsLost) {
  network_ = {0.1, 0.05, Nanos{1'000'000}, Nanos{2'000'000}};
  PortWriter camera;
  PortReader reader;
  connect("-camera1", ROBORUN_PORT_DEPTH, 4 * kPixels, camera, reader);
  std::uint32_t sequence = 0, before = 0, got = 0;
  Nanos written{0};
  const auto each = [&] {
    if (now_ - written >= Nanos{50'000'000}) {
      write_image(camera, ++sequence);
      written = now_;
    }
    PortSample port;
    if (reader.newest(port) != Status::kOk) return;
    const auto image = sample_of<roborun_port_depth>(port);
    ASSERT_GT(image.at.sequence, before);
    before = image.at.sequence;
    ++got;
    std::vector<float> pixels(port.payload.size() / sizeof(float));
    std::memcpy(pixels.data(), port.payload.data(), port.payload.size());
    ASSERT_EQ(pixels.size(), kPixels);
    ASSERT_TRUE(std::all_of(pixels.begin(), pixels.end(),
                            [&](float p) { return p == static_cast<float>(image.at.sequence); }));
  };
  run_for(Nanos{20'000'000'000}, each);
  // 28 pieces each: without asking again, one of twenty would be whole.
  EXPECT_GE(got, 0.99 * sequence);
  EXPECT_GT(share_->sender().counters().repeated, 100U);
}

TEST_F(PortBridgeTest, BringsTheRuntimesFramesBackOnThePlantsClock) {
  network_ = {0.1, 0.0, Nanos{1'000'000}, Nanos{500'000}};
  PortWriter out;
  PortReader reader;
  connect("-bus-out", ROBORUN_PORT_CAN, 0, out, reader, false);
  std::uint32_t sent = 0, got = 0;
  run_for(Nanos{5'000'000'000}, [&] {
    for (int i = 0; i < 3; ++i) {
      roborun_port_can frame{};
      frame.at = {far_clock().time_since_epoch().count(), ++sent, 0};
      frame.id = sent;
      ASSERT_TRUE(out.write(frame));
    }
    for (PortSample port; reader.next(port) == Status::kOk;) {
      const auto frame = sample_of<roborun_port_can>(port);
      ASSERT_EQ(frame.id, ++got);
      ASSERT_LT(Nanos{std::abs((near_clock() - MonotonicTime{Nanos{frame.at.stamp_ns}}).count())},
                Nanos{30'000'000});
    }
  });
  EXPECT_GT(got + 100, sent);
}

TEST_F(PortBridgeTest, GoesOnWithAnotherPlantAnotherFormatAndAnotherShare) {
  std::optional<PortWriter> camera;
  ASSERT_EQ(camera.emplace().open(here_ + "-camera1", ROBORUN_PORT_DEPTH, 4 * kPixels, 4), "");
  meet();
  PortReader reader;
  PortSample port;
  ASSERT_EQ(reader.open(there_ + "-camera1", ROBORUN_PORT_DEPTH), "");
  write_image(*camera, 1);
  run_for(Nanos{20'000'000});
  EXPECT_EQ(reader.newest(port), Status::kOk);
  // The same layout: the same file there.
  ASSERT_EQ(camera.emplace().open(here_ + "-camera1", ROBORUN_PORT_DEPTH, 4 * kPixels, 4), "");
  write_image(*camera, 2);
  run_for(Nanos{300'000'000});
  EXPECT_EQ(reader.newest(port), Status::kOk);
  EXPECT_FALSE(reader.is_replaced());
  // Another one: another file.
  ASSERT_EQ(camera.emplace().open(here_ + "-camera1", ROBORUN_PORT_DEPTH, 8 * kPixels, 4), "");
  run_for(Nanos{300'000'000});
  write_image(*camera, 3);
  run_for(Nanos{300'000'000});
  ASSERT_TRUE(reader.is_replaced());
  ASSERT_EQ(reader.reopen(), "");
  write_image(*camera, 4);
  run_for(Nanos{20'000'000});
  EXPECT_EQ(reader.newest(port), Status::kOk);
  start_share();
  run_for(Nanos{1'000'000'000});
  write_image(*camera, 5);
  run_for(Nanos{20'000'000});
  ASSERT_EQ(reader.newest(port), Status::kOk);
  EXPECT_EQ(sample_of<roborun_port_depth>(port).at.sequence, 5U);
  EXPECT_FALSE(reader.is_replaced());
}

TEST_F(PortBridgeTest, FollowsAClockThatIsSet) {
  PortWriter imu;
  PortReader reader;
  connect("-imu", ROBORUN_PORT_IMU, 0, imu, reader);
  apart_ += Nanos{3'600'000'000'000};  // as after a pause of the other machine
  run_for(Nanos{2'000'000'000});
  Nanos error{};
  measure_stamp_error(imu, reader, error);
  EXPECT_LT(error, Nanos{2'000'000});
}

TEST_F(PortBridgeTest, SaysNothingToNobodyAndNothingWithoutTheTime) {
  PortWriter imu;
  ASSERT_EQ(imu.open(here_ + "-imu", ROBORUN_PORT_IMU, 0, 1024), "");
  network_.loss = 1.0;
  for (std::uint32_t i = 0; i < 100; ++i) {
    write_imu(imu, i);
    run_for(Nanos{10'000'000});
  }
  EXPECT_EQ(share_->sender().counters().samples, 0U);
  // An answer takes 24 ms: which time it is over there nobody can say.
  network_ = {0.0, 0.0, Nanos{12'000'000}, Nanos{0}};
  run_for(Nanos{3'000'000'000});
  EXPECT_TRUE(fetch_->is_heard(far_clock()));
  EXPECT_FALSE(fetch_->is_matched());
  EXPECT_GT(fetch_->slow_answers(), 10U);
  EXPECT_FALSE(std::filesystem::exists(there_ + "-imu"));
  network_ = {};
  run_for(Nanos{3'000'000'000});
  EXPECT_TRUE(std::filesystem::exists(there_ + "-imu"));
  network_.loss = 1.0;
  run_for(Nanos{2'000'000'000});
  EXPECT_FALSE(fetch_->is_heard(far_clock()));
  EXPECT_FALSE(share_->is_heard(near_clock()));
}

TEST_F(PortBridgeTest, RefusesAPortThatAnotherProcessWrites) {
  PortWriter imu, taken;
  ASSERT_EQ(imu.open(here_ + "-imu", ROBORUN_PORT_IMU, 0, 64), "");
  ASSERT_EQ(taken.open(there_ + "-imu", ROBORUN_PORT_IMU, 0, 64), "");
  EXPECT_THROW(run_for(Nanos{2'000'000'000}), InputError);
}

/// Frames of a real exchange with bytes changed, cut and made up, and of any session: nothing is written outside of its port, and no port is made
/// that nobody asked for.
TEST_F(PortBridgeTest, BelievesNoDatagram) {
  PortWriter imu, camera;
  ASSERT_EQ(imu.open(here_ + "-imu", ROBORUN_PORT_IMU, 0, 64), "");
  ASSERT_EQ(camera.open(here_ + "-camera1", ROBORUN_PORT_DEPTH, 4 * kPixels, 4), "");
  meet();
  std::vector<std::pair<bool, Bytes>> seen;
  const auto keep = [&] {
    for (const auto& [due, datagram] : waiting_)
      if (seen.size() < 4000) seen.push_back(datagram);
  };
  network_.delay = Nanos{1'000'000};
  network_.loss = 0.05;
  for (std::uint32_t i = 0; i < 50; ++i) {
    write_imu(imu, i);
    write_image(camera, i);
    run_for(Nanos{5'000'000}, keep);
  }
  ASSERT_GT(seen.size(), 1000U);
  const auto nothing = [](std::span<const std::uint8_t>) {};
  for (int i = 0; i < 200'000; ++i) {
    auto [to_far, datagram] = seen[random_() % seen.size()];
    for (int n = static_cast<int>(random_() % 4); n >= 0; --n)
      datagram[random_() % std::min<std::size_t>(datagram.size(), 64)] = static_cast<std::uint8_t>(random_());
    if (random_() % 4 == 0) datagram.resize(random_() % datagram.size());
    try {
      if (to_far)
        fetch_->take(far_clock(), datagram, nothing);
      else
        share_->take(near_clock(), datagram, nothing);
    } catch (const InputError&) {  // a name of a port that is written here
    }
  }
  EXPECT_GT(share_->refused() + fetch_->refused(), 10'000U);
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(test::scratch_folder())) {
    const std::string name = entry.path().filename();
    EXPECT_TRUE(name.starts_with("here-") || name.starts_with("there-")) << name;
    bytes += entry.file_size();
  }
  EXPECT_LT(bytes, (kMostStreams + 4) * PortReceiver::kMostFile_bytes);
}

}  // namespace
}  // namespace roborun::sensor_port
