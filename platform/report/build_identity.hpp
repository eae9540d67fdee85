/// From what sources, and how, this program was built: what leads a dated report back to them.
#pragma once

#include <string_view>

namespace roborun::report {

struct BuildIdentity {
  std::string_view version;  ///< Of the project: CMakeLists.txt.
  /// 40 hexadecimal digits, of the time of the build; "+changes" behind them where tracked files differed from
  /// that commit; "unknown" where the sources were not under git.
  std::string_view commit;
  std::string_view commit_date;  ///< Of that commit, YYYY-MM-DD; "unknown" with it.
  std::string_view compiler;     ///< Name and version.
  std::string_view flags;        ///< Build type and the flags that go with it.
};

[[nodiscard]] BuildIdentity build_identity() noexcept;

}  // namespace roborun::report
