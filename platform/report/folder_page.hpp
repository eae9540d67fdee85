/// The flights of a folder as one table that opens offline, each with a link to its page.
#pragma once

#include <string>
#include <vector>

namespace roborun::report {

/// NaN: not known.
struct FolderRow {
  /// Passed: a scenario that asked for another end than the goal, or for the goal and more.
  enum class Verdict : unsigned char { kFailed, kUnknown, kReached, kPassed };

  std::string name;
  std::string page;  ///< Path of its page from the table's; empty: it has none.
  Verdict verdict{Verdict::kUnknown};
  std::string reason;  ///< Why it ended.
  std::string note;    ///< What else there is to know, such as where its log is cut; or empty.
  double time_s{}, mean_mps{}, closest_m{};
  std::vector<std::string> complaints{};  ///< What a scenario asked for and did not get, one line each.
};

/// A complete HTML file without a request or a script: failed flights first, then those of which nobody knows, then by name.
/// `skipped`: one line for each file that holds no flight.
[[nodiscard]] std::string folder_page_html(const std::string& title, std::vector<FolderRow> rows,
                                           const std::vector<std::string>& skipped);

}  // namespace roborun::report
