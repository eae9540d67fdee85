/// What is particular to SocketCAN.
#include "platform/can/socket_can.hpp"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

namespace roborun::can {
namespace {

can_frame error_frame(canid_t kind, std::uint8_t controller = 0) {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | kind;
  frame.can_dlc = CAN_ERR_DLC;
  frame.data[1] = controller;
  return frame;
}

TEST(SocketCan, NamesErrorFrames) {
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_BUSOFF)).bus_off);
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_RESTARTED)).restarted);
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_ACK)).no_acknowledge);
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE)).passive);
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE)).passive);
  EXPECT_TRUE(classify_error(error_frame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE)).active);
  const CanErrorReport other = classify_error(error_frame(CAN_ERR_PROT, 0xff));
  EXPECT_FALSE(other.bus_off || other.restarted || other.passive || other.active || other.no_acknowledge);
}

TEST(SocketCan, SaysWhyItCannotOpen) {
  SocketCan sut;
  EXPECT_NE(sut.open("nocan7").find("nocan7: "), std::string::npos);
  firmware_if::CanFrame frame;
  EXPECT_EQ(sut.receive(frame), Status::kIo);
  EXPECT_EQ(sut.send({&frame, 1}), Status::kIo);
  EXPECT_EQ(sut.state(), firmware_if::CanState::kDetached);
}

// An error frame written to vcan comes out of every other socket as one from the controller.
TEST(SocketCan, SendsNothingBetweenBusOffAndRestart) {
  const char* name = std::getenv("ROBORUN_TEST_VCAN");
  if (name == nullptr) GTEST_SKIP() << "no vcan: ROBORUN_TEST_VCAN is not set";
  SocketCan sut;
  ASSERT_EQ(sut.open(name), "");
  const int raw = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(name));
  ASSERT_EQ(bind(raw, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  const auto inject = [&](canid_t kind) {
    const can_frame frame = error_frame(kind);
    ASSERT_EQ(write(raw, &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
    std::this_thread::sleep_for(std::chrono::milliseconds{50});
    firmware_if::CanFrame unused;
    EXPECT_EQ(sut.receive(unused), Status::kNotReady);
  };
  firmware_if::CanFrame frame;
  inject(CAN_ERR_BUSOFF);
  EXPECT_EQ(sut.state(), firmware_if::CanState::kBusOff);
  EXPECT_EQ(sut.send({&frame, 1}), Status::kNotReady);
  inject(CAN_ERR_RESTARTED);
  EXPECT_EQ(sut.state(), firmware_if::CanState::kActive);
  EXPECT_EQ(sut.send({&frame, 1}), Status::kOk);
  EXPECT_EQ(sut.counters().bus_off, 1U);
  (void)close(raw);
}

}  // namespace
}  // namespace roborun::can
