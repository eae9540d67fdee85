#include "platform/input/toml_reader.hpp"

#include <gtest/gtest.h>

namespace roborun::input {
namespace {

std::string complaint(const std::string& value) {
  try {
    const toml::table root = parse_toml("f.toml", "a = 1\nkey = " + value);
    (void)TomlReader("f.toml").whole(*root.get("key"), "key", 8, 1280);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(TomlReader, AWholeNumberIsOne) {
  EXPECT_EQ(complaint("96"), "");
  EXPECT_EQ(complaint("96.0"), "");
  for (const char* value : {"96.5", "7", "1281", "nan", "inf", "\"96\"", "true", "[96]"})
    EXPECT_EQ(complaint(value), "f.toml:2: key: must be a whole number from 8 to 1280") << value;
}

TEST(TomlReader, NothingNestsWithoutEnd) {
  std::string keys = "a";
  for (int i = 0; i < 500000; ++i) keys += ".a";
  EXPECT_THROW((void)parse_toml("f.toml", keys + " = 1"), InputError);
  EXPECT_THROW((void)parse_toml("f.toml", "[" + keys + "]\nx = 1"), InputError);
  EXPECT_THROW((void)parse_toml("f.toml", "a = " + std::string(1000000, '[')), InputError);
  std::string tables;
  for (int i = 0; i < 200000; ++i) tables += "{a=";
  EXPECT_THROW((void)parse_toml("f.toml", "a = " + tables), InputError);
}

}  // namespace
}  // namespace roborun::input
