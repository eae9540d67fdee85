#include "platform/report/build_identity.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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
    ASSERT_EQ(id.commit_date.size(), 10U) << id.commit_date;
    EXPECT_TRUE(id.commit_date[4] == '-' && id.commit_date[7] == '-') << id.commit_date;
    EXPECT_TRUE(id.commit.size() == 40 || id.commit.substr(40) == "+changes") << id.commit;
  }
  EXPECT_EQ(std::count(id.version.begin(), id.version.end(), '.'), 2) << id.version;
  EXPECT_NE(id.compiler.find_first_of("0123456789"), std::string_view::npos) << id.compiler;
  EXPECT_FALSE(id.flags.empty());
}

}  // namespace
}  // namespace roborun::report
