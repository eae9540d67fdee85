// Connections of the operating system, on loopback and on a pseudo terminal.
#include "platform/mavlink/link.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>
#include <vector>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/input/input_error.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::mavlink {
namespace {

namespace mav = firmware_if::mavlink;

std::vector<std::uint8_t> frames(std::size_t count) {
  std::vector<std::uint8_t> all;
  std::array<std::uint8_t, mav::kMostFrame_bytes> bytes{};
  for (std::size_t i = 0; i < count; ++i) {
    mav::Odometry message;
    message.quality = 100;
    const auto length = mav::write_frame(mav::Odometry::kType, {static_cast<std::uint8_t>(i), 1, 1},
                                         mav::pack(message), nullptr, bytes);
    all.insert(all.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length.value()));
  }
  return all;
}

/// Time of the tests: it moves on by a millisecond with each look, so that retries are due without waiting for them.
class Clock {
 public:
  MonotonicTime now() { return now_ += Nanos{1'000'000}; }
  void pass(double time_s) { now_ += from_seconds(time_s); }

 private:
  MonotonicTime now_{Nanos{1}};
};

/// What comes within 2 s, until it is `enough` bytes.
std::vector<std::uint8_t> drain(Link& link, Clock& clock, std::size_t enough) {
  std::vector<std::uint8_t> all;
  std::array<std::uint8_t, 4096> bytes{};
  for (int i = 0; i < 2000 && all.size() < enough; ++i) {
    const std::size_t count = link.read(clock.now(), bytes);
    all.insert(all.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
    if (count == 0) std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  return all;
}

LinkAddress udp(LinkAddress::Kind kind, int port) { return {kind, "127.0.0.1", port}; }

TEST(LinkAddress, ReadsTheFourKindsAndRefusesTheRestInOneLine) {
  EXPECT_EQ(parse_link("udpin://:14540").host, "0.0.0.0");
  EXPECT_EQ(parse_link("udpout://127.0.0.1:14550").number, 14550);
  EXPECT_EQ(parse_link("tcp://localhost:5760").host, "127.0.0.1");
  const LinkAddress serial = parse_link("serial:///dev/ttyACM0:921600");
  EXPECT_EQ(serial.host, "/dev/ttyACM0");
  EXPECT_EQ(serial.number, 921600);
  for (const char* bad : {"", "udp", "udp://1.2.3.4:1", "udpout://1.2.3.4", "udpout://1.2.3.4:0",
                          "tcp://1.2.3.4:70000", "tcp://example.org:1", "serial://ttyACM0:115200",
                          "serial:///dev/ttyACM0:12345", "udpout://1.2.3.4:12x"}) {
    try {
      (void)parse_link(bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

TEST(Link, BringsDatagramsBothWaysAndHearsItsPeerAlone) {
  Clock clock;
  Link server(udp(LinkAddress::Kind::kUdpIn, 0));
  std::array<std::uint8_t, 2048> bytes{};
  EXPECT_EQ(server.read(clock.now(), bytes), 0U);
  ASSERT_GT(server.local_port(), 0);
  Link client(udp(LinkAddress::Kind::kUdpOut, server.local_port()));
  (void)client.read(clock.now(), bytes);
  const auto hello = frames(1);
  EXPECT_EQ(server.write(clock.now(), hello), 0U) << "nobody has spoken yet";
  EXPECT_EQ(client.write(clock.now(), hello), hello.size());
  EXPECT_EQ(drain(server, clock, hello.size()), hello);
  const auto answer = frames(40);
  ASSERT_GT(answer.size(), 4 * Link::kDatagram_bytes);
  EXPECT_EQ(server.write(clock.now(), answer), answer.size());
  EXPECT_EQ(drain(client, clock, answer.size()), answer) << "in datagrams of whole frames";
  Link stranger(udp(LinkAddress::Kind::kUdpOut, server.local_port()));
  (void)stranger.read(clock.now(), bytes);
  EXPECT_GT(stranger.write(clock.now(), hello), 0U);
  for (int i = 0; i < 200 && server.counters().foreign_datagrams == 0; ++i) {
    EXPECT_EQ(server.read(clock.now(), bytes), 0U);
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  EXPECT_EQ(server.counters().foreign_datagrams, 1U);
  clock.pass(6.0);  // the peer is silent: who speaks next is the peer
  EXPECT_GT(stranger.write(clock.now(), hello), 0U);
  EXPECT_EQ(drain(server, clock, hello.size()), hello);
}

TEST(Link, SendsAThousandSetPointsOverLoopbackAndNoneIsLostOrDoubled) {
  Clock clock;
  Link server(udp(LinkAddress::Kind::kUdpIn, 0));
  std::array<std::uint8_t, 4096> bytes{};
  (void)server.read(clock.now(), bytes);
  Link client(udp(LinkAddress::Kind::kUdpOut, server.local_port()));
  (void)client.read(clock.now(), bytes);
  mav::Receiver receiver;
  std::uint8_t next = 0;
  int heard = 0;
  const test::NoAllocScope scope;
  for (int i = 0; i < 1000; ++i) {
    std::array<std::uint8_t, mav::kMostFrame_bytes> frame{};
    const auto length =
        mav::write_frame(mav::SetPositionTargetLocalNed::kType, {static_cast<std::uint8_t>(i), 1, 191},
                         mav::pack(mav::SetPositionTargetLocalNed{}), nullptr, frame);
    (void)client.write(clock.now(), std::span<const std::uint8_t>(frame).first(length.value()));
    for (std::size_t count = 1; count > 0;) {
      count = server.read(clock.now(), bytes);
      std::span<const std::uint8_t> came(bytes.data(), count);
      while (!came.empty()) {
        came = came.subspan(receiver.push(came));
        mav::Frame in;
        while (receiver.next(in) == mav::Event::kFrame) {
          EXPECT_EQ(in.header.seq, next++);
          ++heard;
        }
      }
    }
  }
  EXPECT_EQ(scope.count(), 0U);
  EXPECT_EQ(heard, 1000);
}

/// Listens on a port that the kernel chooses, or on one that was.
int listening(int& port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  const int yes = 1;
  (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  EXPECT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);  // NOLINT
  EXPECT_EQ(::listen(fd, 1), 0);
  socklen_t size = sizeof address;
  (void)getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);  // NOLINT
  port = ntohs(address.sin_port);
  return fd;
}

TEST(Link, ComesBackWhenATcpServerRestarts) {
  Clock clock;
  int port = 0;
  int server = listening(port);
  Link sut({LinkAddress::Kind::kTcp, "127.0.0.1", port});
  std::array<std::uint8_t, 2048> bytes{};
  const auto connect = [&] {
    for (int i = 0; i < 3000 && !sut.is_open(); ++i) {
      (void)sut.read(clock.now(), bytes);
      std::this_thread::sleep_for(std::chrono::microseconds{300});
    }
    return sut.is_open();
  };
  ASSERT_TRUE(connect());
  int peer = ::accept(server, nullptr, nullptr);
  const auto hello = frames(2);
  ASSERT_EQ(::send(peer, hello.data(), hello.size(), 0), static_cast<ssize_t>(hello.size()));
  EXPECT_EQ(drain(sut, clock, hello.size()), hello);
  (void)::close(peer);
  (void)::close(server);
  for (int i = 0; i < 1000 && sut.counters().lost == 0; ++i) (void)sut.read(clock.now(), bytes);
  EXPECT_EQ(sut.counters().lost, 1U);
  EXPECT_EQ(sut.write(clock.now(), hello), 0U);
  clock.pass(1.0);
  (void)sut.read(clock.now(), bytes);
  EXPECT_FALSE(sut.is_open());
  server = listening(port);
  clock.pass(1.0);
  ASSERT_TRUE(connect());
  peer = ::accept(server, nullptr, nullptr);
  EXPECT_EQ(sut.write(clock.now(), hello), hello.size());
  EXPECT_EQ(sut.counters().opened, 2U);
  (void)::close(peer);
  (void)::close(server);
}

TEST(Link, ComesBackWhenASerialLineIsPluggedInAgain) {
  Clock clock;
  const auto terminal = [] {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    EXPECT_EQ(::grantpt(master), 0);
    EXPECT_EQ(::unlockpt(master), 0);
    return master;
  };
  int master = terminal();
  // A name that stays, as udev gives one to a device that comes and goes.
  const std::string name = ::testing::TempDir() + "roborun_link_test_tty_" + std::to_string(::getpid());
  (void)::unlink(name.c_str());
  ASSERT_EQ(::symlink(::ptsname(master), name.c_str()), 0);
  Link sut({LinkAddress::Kind::kSerial, name, 921600});
  std::array<std::uint8_t, 2048> bytes{};
  EXPECT_EQ(sut.read(clock.now(), bytes), 0U);
  ASSERT_TRUE(sut.is_open()) << sut.why();
  const auto hello = frames(3);  // with every byte value that a terminal would treat in its own way
  ASSERT_EQ(::write(master, hello.data(), hello.size()), static_cast<ssize_t>(hello.size()));
  EXPECT_EQ(drain(sut, clock, hello.size()), hello);
  (void)::close(master);
  (void)::unlink(name.c_str());
  for (int i = 0; i < 1000 && sut.counters().lost == 0; ++i) (void)sut.read(clock.now(), bytes);
  EXPECT_EQ(sut.counters().lost, 1U);
  clock.pass(1.0);
  EXPECT_EQ(sut.read(clock.now(), bytes), 0U);
  EXPECT_FALSE(sut.is_open());
  EXPECT_EQ(sut.why(), ENOENT);
  master = terminal();
  ASSERT_EQ(::symlink(::ptsname(master), name.c_str()), 0);
  clock.pass(1.0);
  (void)sut.read(clock.now(), bytes);
  ASSERT_TRUE(sut.is_open());
  EXPECT_EQ(sut.write(clock.now(), hello), hello.size());
  (void)::close(master);
  (void)::unlink(name.c_str());
}

}  // namespace
}  // namespace roborun::mavlink
