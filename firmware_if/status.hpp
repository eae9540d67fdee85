/// The outcome of a call. Vocabulary of the whole project, hence directly in namespace roborun.
/// "Weather" (a late frame, a full pool, NaN from a sensor) is a Status; our own bug is an assertion
/// (ROBORUN_ASSERT, assert.hpp), which is armed in every build.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "firmware_if/assert.hpp"

namespace roborun {

enum class [[nodiscard]] Status : std::uint8_t{
    kOk,
    kNotReady,         ///< Nothing there yet. Not an error, never counted.
    kInvalidArgument,  ///< Not finite, out of range, or of the wrong size. Nothing was changed.
    kBudgetSpent,      ///< The time or volume granted is used up; the result is the best so far.
    kCapacity,         ///< A pool of fixed size is full; the written answer of its owner was applied.
    kStale,            ///< Older than allowed.
    kStartBlocked,     ///< Planner: the start is not in known free space.
    kGoalBlocked,      ///< Planner: the goal is occupied or out of bounds.
    kNoPath,           ///< Planner, smoother: nothing better than standing still was found.
    kInfeasible,       ///< Solver: no point satisfies every constraint; the safest one is returned.
    kIo,               ///< A device or a file failed.
};

[[nodiscard]] constexpr const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kNotReady:
      return "not ready";
    case Status::kInvalidArgument:
      return "invalid argument";
    case Status::kBudgetSpent:
      return "budget spent";
    case Status::kCapacity:
      return "capacity";
    case Status::kStale:
      return "stale";
    case Status::kStartBlocked:
      return "start blocked";
    case Status::kGoalBlocked:
      return "goal blocked";
    case Status::kNoPath:
      return "no path";
    case Status::kInfeasible:
      return "infeasible";
    case Status::kIo:
      return "i/o";
  }
  return "unknown status";
}

/// A value, or the reason why there is none. RT-safe if T is.
template <typename T>
class [[nodiscard]] Result {
 public:
  // Implicit, so that `return Status::kNoPath;` and `return value;` both read well.
  Result(Status status) noexcept : status_(status) {}  // NOLINT(google-explicit-constructor)
  Result(T value) noexcept
      : value_(std::move(value)), status_(Status::kOk) {}  // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const noexcept { return value_.has_value(); }
  [[nodiscard]] Status status() const noexcept { return status_; }
  /// Precondition, asserted: ok().
  [[nodiscard]] T& value() noexcept {
    ROBORUN_ASSERT(ok());
    return *value_;
  }
  [[nodiscard]] const T& value() const noexcept {
    ROBORUN_ASSERT(ok());
    return *value_;
  }

 private:
  std::optional<T> value_{};
  Status status_;
};

}  // namespace roborun
