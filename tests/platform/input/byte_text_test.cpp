#include "platform/input/byte_text.hpp"

#include <gtest/gtest.h>

namespace roborun::input {
namespace {

TEST(ByteText, GivesEveryByteBack) {
  std::vector<std::uint8_t> all;
  for (unsigned byte = 0; byte < 256; ++byte) all.push_back(static_cast<std::uint8_t>(byte));
  EXPECT_EQ(text_of_bytes(all).size(), 128U + 2U * 128U);
  EXPECT_EQ(bytes_of_text(text_of_bytes(all)), all);
}

TEST(ByteText, RefusesWhatIsNoByte) {
  EXPECT_FALSE(bytes_of_text("\u0100"));
  EXPECT_FALSE(bytes_of_text("\u20ac"));
  EXPECT_FALSE(bytes_of_text("\xc3"));  // cut
}

}  // namespace
}  // namespace roborun::input
