/// The folder of a sweep: request.json (the plan), results.jsonl (one line per mission),
/// flight_DESIGN_SEED.json (of the representative environment). What was written survives Ctrl-C and power
/// loss; a half line at the end does not count.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "platform/evaluation/sweep_plan.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::evaluation {

class SweepStore {
 public:
  /// Makes the folder, or opens what a stopped run of the same plan left there. Throws InputError: the
  /// folder cannot be written, belongs to another plan, is in use by another process, or has a line that is
  /// none of the plan's results.
  SweepStore(std::string folder, SweepPlan plan);
  ~SweepStore();
  SweepStore(const SweepStore&) = delete;
  SweepStore& operator=(const SweepStore&) = delete;

  [[nodiscard]] const SweepPlan& plan() const { return plan_; }
  [[nodiscard]] const std::vector<SweepMission>& missions() const { return missions_; }
  [[nodiscard]] bool has(std::size_t mission) const { return lines_.count(mission) != 0; }
  [[nodiscard]] bool complete() const { return lines_.size() == missions_.size(); }
  [[nodiscard]] const std::string& folder() const { return folder_; }

  /// Writes a mission's line, and before it its flight if that is not empty; both are on the disk when this
  /// returns.
  void add(std::size_t mission, const std::string& line, const std::string& flight);
  /// Puts the lines into the order of the plan, whatever order they came in.
  void sort();
  /// In the order of the plan.
  [[nodiscard]] std::vector<report::MissionResult> results() const;
  /// Empty if there is none.
  [[nodiscard]] std::string flight(const SweepMission& mission) const;

 private:
  void take_lines(const std::string& text);
  [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }

  std::string folder_;
  SweepPlan plan_;
  std::vector<SweepMission> missions_;
  std::map<std::size_t, std::string> lines_;  ///< By index into missions_.
  int lock_{-1};
  int file_{-1};
};

/// Throws InputError if one of the files that a sweep reads lies in the folder that it writes.
void check_folder(const std::string& folder, const std::vector<std::string>& inputs);

/// The plan of a folder that exists. Throws InputError.
[[nodiscard]] SweepPlan plan_of_folder(const std::string& folder);

/// Makes one folder of the shards of one sweep, as if it had been flown in one: the result has all their
/// missions, and may miss some. Throws InputError if the shards are of different sweeps or contradict
/// each other.
void merge_shards(const std::vector<std::string>& folders, const std::string& out);

}  // namespace roborun::evaluation
