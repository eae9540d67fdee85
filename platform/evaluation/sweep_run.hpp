/// Flies the missions of a sweep's plan, and turns its folder into tables and pictures.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "platform/board/board_profile.hpp"
#include "platform/evaluation/sweep_store.hpp"
#include "platform/mission/mission.hpp"
#include "platform/report/sweep_summary.hpp"

namespace roborun::evaluation {

/// What the digests of a plan stand for.
struct SweepInputs {
  std::map<std::string, board::Profile> profile;  ///< By the plan's names.
  mission::MissionConfig base{};                  ///< With the settings in it.
  std::vector<std::string> files;  ///< All that was read for them; not in the folder of the sweep.
};

/// Throws InputError for a map, planner or settings that no mission of the plan could fly with; nothing
/// is flown or written.
void try_sweep(const SweepPlan& plan, const SweepInputs& inputs);

/// Flies what the store does not have yet, `jobs` missions at a time, each in a process of its own, with a
/// progress line; then sorts the lines. False if Ctrl-C ended it or a mission's process died: what is there
/// stays, and the same call goes on.
[[nodiscard]] bool fly_sweep(SweepStore& store, const SweepInputs& inputs, int jobs);

[[nodiscard]] std::vector<report::SweepRow> rows_of(const SweepStore& store);

/// Writes the pictures, report.html and tables.txt into the store's folder: the same lines give the same
/// bytes. Throws InputError if a file cannot be written.
void write_sweep_report(const SweepStore& store);

}  // namespace roborun::evaluation
