#include "platform/report/build_identity.hpp"

#include <gtest/gtest.h>

#include <cctype>
#include <string>

namespace roborun::report {
namespace {

TEST(BuildIdentity, LeadsBackToTheSource) {
  const BuildIdentity id = build_identity();
  if (id.commit != "unknown") {
    const std::string commit(id.commit.substr(0, 40));
    EXPECT_EQ(commit.size(), 40U);
    for (const char c : commit) EXPECT_TRUE(std::isxdigit(static_cast<unsigned char>(c)) != 0) << commit;
    EXPECT_TRUE(id.commit.size() == 40 || id.commit.substr(40) == "+changes") << id.commit;
  }
  EXPECT_NE(id.compiler.find_first_of("0123456789"), std::string_view::npos) << id.compiler;
  EXPECT_FALSE(id.flags.empty());
}

}  // namespace
}  // namespace roborun::report
