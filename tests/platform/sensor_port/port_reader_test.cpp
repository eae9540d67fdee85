#include "platform/sensor_port/port_reader.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <csignal>
#include <cstring>
#include <fstream>
#include <functional>
#include <numeric>
#include <random>
#include <thread>

#include "tests/platform/sensor_port/one_mapping.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::sensor_port {
namespace {

constexpr std::uint32_t kPayload_bytes = 256;

/// A sample of which every byte follows from its number.
struct Numbered {
  roborun_port_imu sample{};
  std::array<std::uint64_t, kPayload_bytes / 8> payload{};
  explicit Numbered(std::uint32_t n) {
    sample.at = {std::int64_t{n} * 1000, n, 0};
    for (double& x : sample.angular_rate_B_radps) x = n;
    for (double& x : sample.specific_force_B_mps2) x = n;
    payload.fill(n);
  }
};

/// False: pieces of different samples.
bool is_whole(const PortSample& port) {
  roborun_port_imu sample;
  std::memcpy(&sample, port.sample.data(), sizeof sample);
  const Numbered wanted(sample.at.sequence);
  return std::memcmp(&sample, &wanted.sample, sizeof sample) == 0 && port.payload.size() == kPayload_bytes &&
         std::memcmp(port.payload.data(), wanted.payload.data(), kPayload_bytes) == 0;
}

std::uint32_t number_of(const PortSample& port) {
  roborun_port_imu sample;
  std::memcpy(&sample, port.sample.data(), sizeof sample);
  return sample.at.sequence;
}

class PortReaderTest : public ::testing::Test {
 protected:
  PortReaderTest() : path_(test::scratch("roborun-imu")) { std::remove(path_.c_str()); }
  ~PortReaderTest() override { roborun_port_close(&writer_); }
  void open_writer(std::uint32_t slots = 4) {
    const char* wrong = roborun_port_open(&writer_, path_.c_str(), ROBORUN_PORT_IMU, kPayload_bytes, slots);
    ASSERT_EQ(wrong, nullptr) << wrong;
  }
  void write(std::uint32_t n) {
    const Numbered numbered(n);
    ASSERT_EQ(roborun_port_write(&writer_, &numbered.sample, numbered.payload.data(), kPayload_bytes), 0);
  }
  std::string path_;
  roborun_port_writer writer_{-1, 0, nullptr};
  PortReader sut_;
  PortSample out_;
};

TEST_F(PortReaderTest, HandsOutTheNewestOnceAndCountsWhatItMissed) {
  open_writer();
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  EXPECT_EQ(sut_.newest(out_), Status::kNotReady);
  for (std::uint32_t n = 0; n < 3; ++n) write(n);
  ASSERT_EQ(sut_.newest(out_), Status::kOk);
  EXPECT_EQ(number_of(out_), 2U);
  EXPECT_TRUE(is_whole(out_));
  EXPECT_EQ(sut_.newest(out_), Status::kNotReady);
  EXPECT_EQ(sut_.counters().dropped, 2U);
  EXPECT_EQ(sut_.counters().read, 1U);
}

TEST_F(PortReaderTest, HandsOutAllInTheirOrderAsFarAsTheyAreThere) {
  open_writer(4);
  ASSERT_EQ(sut_.open(path_, 0), "");
  EXPECT_EQ(sut_.kind(), std::uint32_t{ROBORUN_PORT_IMU});
  write(0);
  write(1);
  for (std::uint32_t n = 0; n < 2; ++n) {
    ASSERT_EQ(sut_.next(out_), Status::kOk);
    EXPECT_EQ(number_of(out_), n);
  }
  EXPECT_EQ(sut_.next(out_), Status::kNotReady);
  for (std::uint32_t n = 2; n < 12; ++n) write(n);
  ASSERT_EQ(sut_.next(out_), Status::kOk);
  EXPECT_EQ(number_of(out_), 9U) << "three of four slots: the fourth is written next";
  EXPECT_EQ(sut_.counters().dropped, 7U);
}

TEST_F(PortReaderTest, DoesNotAllocate) {
  open_writer();
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  const test::NoAllocScope scope;
  write(0);
  ASSERT_EQ(sut_.newest(out_), Status::kOk);
  write(1);
  ASSERT_EQ(sut_.next(out_), Status::kOk);
  EXPECT_EQ(scope.count(), 0U);
}

TEST_F(PortReaderTest, RefusesInOneLineWhatIsNoPort) {
  open_writer();
  std::ifstream file(path_, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(file), {}};
  const auto refusal = [&good](const std::function<void(roborun_port_header&, std::string&)>& spoil) {
    std::string bytes = good;
    roborun_port_header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    spoil(header, bytes);
    if (bytes.size() >= sizeof header) std::memcpy(bytes.data(), &header, sizeof header);
    PortReader reader;
    return reader.open(test::scratch_file("spoilt", bytes), ROBORUN_PORT_IMU);
  };
  using H = roborun_port_header;
  using S = std::string;
  EXPECT_EQ(refusal([](H&, S&) {}), "");
  EXPECT_EQ(refusal([](H& h, S&) { h.magic[0] = 'R'; }), "is no sensor port: must begin with roborunP");
  EXPECT_EQ(refusal([](H& h, S&) { h.version = 2; }), "is of port version 2: must be 1");
  EXPECT_EQ(refusal([](H& h, S&) { h.kind = 10; }), "holds samples of kind 10: must be 1 to 9");
  EXPECT_NE(refusal([](H& h, S&) { h.sample_bytes = 8; }).find("have 8 bytes: must be 64"), S::npos);
  EXPECT_NE(refusal([](H& h, S&) { h.slot_count = 1; }).find("has 1 slots: must be 2 to 1024"), S::npos);
  EXPECT_NE(refusal([](H& h, S&) { h.slot_bytes += 8; }).find("must be a multiple of 64"), S::npos);
  EXPECT_NE(refusal([](H& h, S&) { h.slot_bytes = 64; }).find("must be a multiple of 64 from 80"), S::npos);
  EXPECT_NE(refusal([](H& h, S&) { h.slot_bytes = 1U << 31U; }).find("must be a multiple of 64"), S::npos);
  EXPECT_NE(refusal([](H& h, S&) { h.slot_count = 5; }).find("bytes: must be"), S::npos);
  EXPECT_NE(refusal([](H&, S& s) { s.resize(s.size() - 64); }).find("bytes: must be"), S::npos);
  EXPECT_NE(refusal([](H&, S& s) { s.resize(40); }).find("shorter than its header"), S::npos);
  EXPECT_NE(refusal([](H&, S& s) { s.clear(); }).find("its size is no port's"), S::npos);
  PortReader other;
  EXPECT_EQ(other.open(path_, ROBORUN_PORT_DEPTH), "holds imu samples: must be depth");
  EXPECT_NE(other.open(path_ + "-nope", 0), "");
  EXPECT_NE(other.open("/dev/zero", 0), "");
  EXPECT_EQ(other.newest(out_), Status::kIo) << "not open";
}

TEST_F(PortReaderTest, AFileThatIsCutShortIsAnAnswerAndNoSignal) {
  open_writer();
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  write(0);
  ASSERT_EQ(sut_.newest(out_), Status::kOk);
  ASSERT_EQ(ftruncate(writer_.file, 0), 0);
  EXPECT_EQ(sut_.newest(out_), Status::kIo);
  EXPECT_EQ(sut_.next(out_), Status::kIo);
  // The writer's side maps it, too: it has to make the file anew.
  munmap(writer_.header, writer_.bytes);
  writer_.header = nullptr;
  roborun_port_close(&writer_);
  open_writer();
  EXPECT_TRUE(sut_.is_replaced());
  ASSERT_EQ(sut_.reopen(), "");
  write(7);
  ASSERT_EQ(sut_.newest(out_), Status::kOk);
  EXPECT_EQ(number_of(out_), 7U);
}

TEST_F(PortReaderTest, ASecondWriterIsRefusedAndAnotherLayoutIsAnotherFile) {
  open_writer();
  roborun_port_writer second{};
  EXPECT_STREQ(roborun_port_open(&second, path_.c_str(), ROBORUN_PORT_IMU, kPayload_bytes, 4),
               "another process writes to this port");
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  roborun_port_close(&writer_);
  open_writer(8);
  EXPECT_TRUE(sut_.is_replaced());
  ASSERT_EQ(sut_.reopen(), "");
  EXPECT_EQ(sut_.slot_count(), 8U);
  EXPECT_STREQ(roborun_port_open(&second, path_.c_str(), 77, 0, 4), "no such kind of sensor");
  EXPECT_STREQ(roborun_port_open(&second, path_.c_str(), ROBORUN_PORT_IMU, 0, 1), "slots: must be 2 to 1024");
  EXPECT_STREQ(roborun_port_open(&second, "/nonexistent/port", ROBORUN_PORT_IMU, 0, 4),
               "No such file or directory");
}

TEST_F(PortReaderTest, AWriterThatStartsAgainGoesOn) {
  open_writer();
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  write(0);
  ASSERT_EQ(sut_.next(out_), Status::kOk);
  roborun_port_close(&writer_);
  open_writer();
  EXPECT_FALSE(sut_.is_replaced());
  write(1);
  ASSERT_EQ(sut_.next(out_), Status::kOk);
  EXPECT_EQ(number_of(out_), 1U);
  EXPECT_EQ(sut_.counters().restarts, 1U);
  EXPECT_EQ(sut_.counters().dropped, 0U);
}

TEST_F(PortReaderTest, BelievesNoLengthAndNoCount) {
  open_writer();
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  write(0);
  auto* slot = reinterpret_cast<roborun_port_slot*>(reinterpret_cast<std::byte*>(writer_.header) + 128);
  slot->payload_bytes = 0xFFFFFFF0U;
  ASSERT_EQ(sut_.newest(out_), Status::kOk);
  EXPECT_TRUE(out_.payload.empty());
  EXPECT_EQ(sut_.counters().refused, 1U);
  writer_.header->written = 1000;
  EXPECT_EQ(sut_.newest(out_), Status::kNotReady) << "no guard says so";
  EXPECT_EQ(sut_.next(out_), Status::kNotReady);
  EXPECT_GE(sut_.counters().torn, 6U);
  writer_.header->written = std::uint64_t{1} << 63U;
  EXPECT_EQ(sut_.newest(out_), Status::kNotReady) << "its guard would be 0, as of slots that nobody wrote";
  EXPECT_EQ(sut_.counters().refused, 2U);
  writer_.header->written = 0;
  EXPECT_EQ(sut_.next(out_), Status::kNotReady);
  EXPECT_EQ(sut_.counters().refused, 3U) << "it fell";
  // What the file says of its layout after it was opened is not read again.
  writer_.header->slot_count = 0;
  writer_.header->slot_bytes = 0xFFFFFFFFU;
  writer_.header->written = 1;
  writer_.header->slot_count = 4;
  slot->payload_bytes = 0;
  EXPECT_EQ(sut_.newest(out_), Status::kOk);
}

/// A writer in a process of its own, as fast as it can, until it is killed.
pid_t start_writer(const std::string& path, std::uint32_t from) {
  const pid_t child = fork();
  if (child != 0) return child;
  roborun_port_writer writer;
  if (roborun_port_open(&writer, path.c_str(), ROBORUN_PORT_IMU, kPayload_bytes, 4) != nullptr) _exit(1);
  for (std::uint32_t n = from;; ++n) {
    const Numbered numbered(n);
    (void)roborun_port_write(&writer, &numbered.sample, numbered.payload.data(), kPayload_bytes);
  }
}

TEST_F(PortReaderTest, TakesNoTornSampleFromAWriterThatIsKilledStoppedAndStartedAgain) {
  open_writer();
  roborun_port_close(&writer_);
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  std::mt19937 random(7);
  constexpr int kReads = 1'000'000, kRounds = 40;
  std::uint64_t taken = 0;
  for (int round = 0; round < kRounds; ++round) {
    (void)sut_.newest(out_);  // the last of the round before
    const pid_t child = start_writer(path_, static_cast<std::uint32_t>(round) << 24U);
    ASSERT_GT(child, 0);
    for (int i = 0; i < 5000 && sut_.newest(out_) != Status::kOk; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // until it is there
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
    const std::uint64_t enough = taken + 50;
    for (int i = 0; i < kReads / kRounds || taken < enough; ++i) {
      if (i == kReads / kRounds / 3) kill(child, SIGSTOP);
      if (i == kReads / kRounds / 2) kill(child, SIGCONT);
      const Status status = i % 2 == 0 ? sut_.newest(out_) : sut_.next(out_);
      ASSERT_NE(status, Status::kIo);
      if (status != Status::kOk) continue;
      ++taken;
      ASSERT_TRUE(is_whole(out_)) << "round " << round << ", read " << i;
    }
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it wrote until it was killed";
  }
  EXPECT_GE(taken, 50U * kRounds);
  EXPECT_GE(sut_.counters().restarts, kRounds - 1U);
}

TEST_F(PortReaderTest, AgreesWithAWriterOfTheSameProcess) {  // for ThreadSanitizer
  open_writer(2);
  ASSERT_EQ(sut_.open(path_, ROBORUN_PORT_IMU), "");
  write(0);
  const OneMapping one(writer_, sut_);
  ASSERT_TRUE(one.is_one());
  constexpr std::uint32_t kSamples = 50'000;
  std::thread thread([this] {
    for (std::uint32_t n = 1; n < kSamples; ++n) {
      const Numbered numbered(n);
      (void)roborun_port_write(&writer_, &numbered.sample, numbered.payload.data(), kPayload_bytes);
    }
  });
  std::uint32_t last = 0;
  while (last != kSamples - 1) {
    if (sut_.newest(out_) != Status::kOk) continue;
    EXPECT_TRUE(is_whole(out_));
    last = number_of(out_);
  }
  thread.join();
  EXPECT_EQ(sut_.counters().read + sut_.counters().dropped, kSamples);
}

}  // namespace
}  // namespace roborun::sensor_port
