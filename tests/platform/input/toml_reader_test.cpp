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

TEST(TomlReader, AComplaintIsOneLineWhateverTheFileSays) {
  EXPECT_NE(complaint("n\n").find("not valid TOML"), std::string::npos);
  EXPECT_EQ(complaint("n\n").find('\n'), std::string::npos) << "the parser quotes what it saw";
  const toml::table root = parse_toml("f.toml", "\"a\\nb\" = 1");
  try {
    TomlReader("f.toml").allow_keys(root, "[x]", {"c"});
    FAIL() << "an unknown key";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "f.toml:1: a b: unknown key in [x]: must be one of c");
  }
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
