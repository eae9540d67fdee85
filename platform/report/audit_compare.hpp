/// Audits before a change beside audits after it: what became worse, by more than the noise of the runs.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace roborun::report {

struct Comparison {
  std::string table;               ///< Of medians over the runs of a side; with a head line.
  std::vector<std::string> worse;  ///< Empty: no regression.
  std::vector<std::string> notes;  ///< Another machine, kernel, build; what the noise is known from.
  /// Names of what the runs differ in although they must agree: then there is no table.
  std::vector<std::string> not_comparable;
};

/// One-sided exact rank test (Mann and Whitney 1947, ties by midranks): the probability that `after` is so much
/// longer than `before` although both are drawn from the same distribution. 1 if one of them is empty.
[[nodiscard]] double rank_test(std::span<const double> before, std::span<const double> after);

/// `before` and `after`: each the JSON of one audit or more, all of one configuration. What was flown must agree in all
/// runs (rate, length, environment, seed, profile, vehicle, settings, load, bus, missing privileges), and the program
/// in those of one side; a difference of the machine is a note.
///
/// A row is worse if its median over the runs is more than `tolerance_ratio` times as long (and 10 us), and, where
/// there are runs enough for it (3 a side), if rank_test() gives at most 0.05. Heap calls and page faults have no
/// noise: there the worst run counts. With fewer runs a note says that the noise is not known.
/// Throws std::invalid_argument with one line for text that is no audit.
[[nodiscard]] Comparison compare_audits(std::span<const std::string> before,
                                        std::span<const std::string> after, double tolerance_ratio);

}  // namespace roborun::report
