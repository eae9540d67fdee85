/// Tasks in processes of their own: what one leaves behind in memory (a library's global seed), or its death,
/// never reaches another, so a result cannot depend on the number of jobs or on the order.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

namespace roborun::evaluation {

struct WorkerCalls {
  /// In the child. What it returns goes to `answered`; a InputError is thrown again in the parent.
  std::function<std::string(std::size_t task)> work;
  /// In the parent, as the answers come in.
  std::function<void(std::size_t task, const std::string& answer)> answered;
  /// In the parent: the child died (no memory, a failed assertion) before it had answered.
  std::function<void(std::size_t task)> died;
  /// In the parent, about five times a second; false ends everything. May be empty.
  std::function<bool()> go_on;
};

/// Runs every task, at most `jobs` (>= 1) at a time, in the order given. Returns false if go_on ended it.
/// Children never outlive the call, however it ends, nor the calling process. For callers without threads.
[[nodiscard]] bool run_in_processes(std::span<const std::size_t> tasks, int jobs, const WorkerCalls& calls);

}  // namespace roborun::evaluation
