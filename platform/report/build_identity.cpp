#include "platform/report/build_identity.hpp"

namespace roborun::report {

extern const char* const kCommit;  // both written at every build: toolchain/cmake/write_commit.cmake
extern const char* const kCommitDate;

BuildIdentity build_identity() noexcept {
  return {ROBORUN_VERSION, kCommit, kCommitDate, ROBORUN_COMPILER, ROBORUN_BUILD_FLAGS};
}

}  // namespace roborun::report
