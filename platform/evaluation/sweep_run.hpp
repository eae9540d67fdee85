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
  /// By the vehicle's name (without one: of the paper's environments), with the settings in it.
  std::map<std::string, mission::MissionConfig> base;
  std::string worlds;              ///< Folder of the suite `foreign`.
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
/// The same of a suite of worlds, whose results may have other commands than those of the store.
void write_suite_report(const SweepStore& store, const std::vector<report::MissionResult>& flights);

}  // namespace roborun::evaluation
