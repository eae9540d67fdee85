#include "platform/report/folder_page.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace roborun::report {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Verdict = FolderRow::Verdict;

FolderRow row(const char* name, Verdict verdict) {
  return {name, std::string(name) + ".html", verdict, "landed", "", 12.5, 2.25, 0.75};
}

TEST(FolderPage, HasFailedFlightsFirstThenByName) {
  const std::string html = folder_page_html("sweep",
                                            {row("b", Verdict::kReached), row("a", Verdict::kReached),
                                             row("z", Verdict::kFailed), row("y", Verdict::kUnknown)},
                                            {});
  std::size_t before = 0;
  for (const char* name : {"z.html", "y.html", "a.html", "b.html"}) {
    const std::size_t at = html.find(name);
    ASSERT_NE(at, std::string::npos) << name;
    EXPECT_GT(at, before) << name;
    before = at;
  }
  EXPECT_NE(html.find("4 flights: 1 failed, 1 unknown, 2 reached the goal"), std::string::npos);
  for (const char* shown : {"12.50", "2.25", "0.75", "landed"})
    EXPECT_NE(html.find(shown), std::string::npos);
}

TEST(FolderPage, HoldsWhateverANameIs) {
  FolderRow odd = row("<b>&\"50% #1?", Verdict::kUnknown);
  odd.note = "cut at <here>";
  odd.closest_m = kNaN;
  const std::string html = folder_page_html("a<b", {odd}, {"x<y: no log"});
  EXPECT_EQ(html.find("<b>"), std::string::npos);
  EXPECT_EQ(html.find("<here>"), std::string::npos);
  EXPECT_NE(html.find("href=\"%3Cb%3E%26%2250%25%20%231%3F.html\""), std::string::npos);
  EXPECT_NE(html.find("x&lt;y: no log"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

TEST(FolderPage, SaysWhatAScenarioDidNotGet) {
  FolderRow failed = row("bad", Verdict::kFailed);
  failed.complaints = {"outcome: landed at 12.50 s, must be <holding>", "touchdown_mps: 3.00 m/s"};
  const std::string html = folder_page_html("failed", {row("good", Verdict::kPassed), failed}, {});
  EXPECT_NE(html.find("2 flights: 1 failed, 0 unknown, 0 reached the goal, 1 passed as their scenarios ask"),
            std::string::npos);
  EXPECT_NE(html.find("<small>outcome: landed at 12.50 s, must be &lt;holding&gt;</small>"),
            std::string::npos);
  EXPECT_NE(html.find("<small>touchdown_mps: 3.00 m/s</small>"), std::string::npos);
  EXPECT_LT(html.find("bad.html"), html.find("good.html"));
  EXPECT_NE(html.find("passed</td>"), std::string::npos);
}

TEST(FolderPage, AsksForNothing) {
  const std::string html = folder_page_html("flights", {row("a", Verdict::kReached)}, {"b"});
  ASSERT_NE(html.find("<table>"), std::string::npos);
  for (const char* request : {"<script", "http:", "https:", " src=", "@import", "url("})
    EXPECT_EQ(html.find(request), std::string::npos) << request;
}

TEST(FolderPage, LinksNoFlightWithoutAPage) {
  FolderRow result = row("result", Verdict::kFailed);
  result.page.clear();
  const std::string html = folder_page_html("flights", {result}, {});
  EXPECT_NE(html.find("<td>result</td>"), std::string::npos);
  EXPECT_EQ(html.find("<a "), std::string::npos);
}

}  // namespace
}  // namespace roborun::report
