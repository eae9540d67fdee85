#include "platform/report/build_identity.hpp"

namespace roborun::report {

extern const char* const kCommit;  // written at every build: toolchain/cmake/write_commit.cmake

BuildIdentity build_identity() noexcept { return {kCommit, ROBORUN_COMPILER, ROBORUN_BUILD_FLAGS}; }

}  // namespace roborun::report
