#include "platform/input/json_reader.hpp"

#include <gtest/gtest.h>

namespace roborun::input {
namespace {

std::string complaint(const std::string& text) {
  try {
    (void)parse_json(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(JsonReader, RefusesWhatIsTooDeepBeforeItIsBuilt) {
  const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
  EXPECT_EQ(complaint(nested(static_cast<std::size_t>(kDeepestJson))), "");
  for (const std::size_t depth : {65UL, 1000UL, 5'000'000UL}) {
    EXPECT_EQ(complaint(nested(depth)), "not JSON: nested more than 64 deep");
    EXPECT_EQ(complaint(std::string(depth, '[')), "not JSON: nested more than 64 deep") << "without an end";
  }
  std::string objects;
  for (int i = 0; i < 1000000; ++i) objects += "{\"a\":";
  EXPECT_EQ(complaint(objects), "not JSON: nested more than 64 deep");
}

TEST(JsonReader, SaysInOneShortLineWhatIsWrong) {
  EXPECT_TRUE(complaint("{broken").starts_with("not JSON: parse error at line 1, column 2"));
  EXPECT_NE(complaint("1e400").find("number overflow"), std::string::npos);
  EXPECT_LT(complaint("\"" + std::string(1U << 20U, 'x')).size(), 300U);
  EXPECT_NE(complaint(""), "");
}

}  // namespace
}  // namespace roborun::input
