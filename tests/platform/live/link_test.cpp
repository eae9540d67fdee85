#include "platform/live/link.hpp"

#include <gtest/gtest.h>

#include "platform/input/input_error.hpp"

namespace roborun::live {
namespace {

std::string refusal(const std::string& text) {
  try {
    (void)link_of(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(LinkTest, NamesPortsOrAPath) {
  EXPECT_EQ(link_of("port:demo").name, "demo");
  EXPECT_EQ(link_of("port:/tmp/x:y").name, "/tmp/x:y");
}

TEST(LinkTest, NamesACanBus) {
  EXPECT_FALSE(link_of("port:demo").dronecan.has_value());
  EXPECT_EQ(link_of("dronecan:port:demo").name, "demo");
  EXPECT_EQ(link_of("dronecan:port:demo").dronecan, "");
  EXPECT_EQ(link_of("dronecan:can0", "demo").name, "demo");
  EXPECT_EQ(link_of("dronecan:can0", "demo").dronecan, "can0");
}

TEST(LinkTest, RefusesInOneLine) {
  EXPECT_EQ(refusal("demo"),
            "--link: 'demo' is no way to a vehicle: must be port:NAME, dronecan:INTERFACE, or a MAVLink URL "
            "(udpin://[HOST]:PORT, ...)");
  EXPECT_EQ(refusal(""),
            "--link: '' is no way to a vehicle: must be port:NAME, dronecan:INTERFACE, or a MAVLink URL "
            "(udpin://[HOST]:PORT, ...)");
  EXPECT_EQ(refusal("port"),
            "--link: 'port' is no way to a vehicle: must be port:NAME, dronecan:INTERFACE, or a MAVLink URL "
            "(udpin://[HOST]:PORT, ...)");
  EXPECT_NE(refusal("port:").find("is no name of ports"), std::string::npos);
  EXPECT_NE(refusal("port:a b").find("is no name of ports"), std::string::npos);
  EXPECT_NE(refusal("port:" + std::string(61, 'a')).find("is no name of ports"), std::string::npos);
  EXPECT_EQ(refusal("dronecan:can0"), "--port: must name the ports of the vehicle's depth images");
  EXPECT_NE(refusal("dronecan:").find("must be followed by an interface"), std::string::npos);
  EXPECT_NE(refusal("dronecan:port:").find("is no name of ports"), std::string::npos);
}

}  // namespace
}  // namespace roborun::live
