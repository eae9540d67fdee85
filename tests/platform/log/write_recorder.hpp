/// What write_recorder.cpp tells of one file: each system call that changes it or brings it to the disk.
#pragma once

#include <cstdint>

namespace roborun::test {

struct RecordedCall {
  enum class What : std::int64_t { kWritten, kCutOff, kSynced, kFolderSynced };
  What what{};
  std::int64_t begin_ns{}, end_ns{};  ///< CLOCK_MONOTONIC.
  std::int64_t size_bytes{};          ///< Of the file, after it.
};

}  // namespace roborun::test
