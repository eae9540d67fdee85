/// What the stages cost on a machine: measured by a sweep over precision and volume, kept in a TOML file.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/executive/cost_profile.hpp"
#include "governor/models/latency_model.hpp"
#include "platform/board/backends.hpp"

namespace roborun::board {

/// What a simulated mission charges, and what its governor expects.
struct Profile {
  core::CostProfile costs{};
  governor::KnobArray<governor::LatencyModel> model{};  ///< Map, export, planner: the 99th percentile.
};

/// A machine that is `factor` times slower.
[[nodiscard]] Profile slower(const Profile& profile, double factor);

/// One stage of a board: its models, and how far they are from points that they were not fitted on.
struct StageModel {
  governor::LatencyModel mean{};
  governor::LatencyModel p99{};
  governor::ModelError mean_error{};
  governor::ModelError p99_error{};
};

struct BoardProfile {
  std::string machine;      ///< What /proc/cpuinfo calls it.
  BackendNames backends{};  ///< That were measured.
  double factor{1.0};       ///< All times count this many times: an estimated board.
  std::array<double, core::kStageCount> per_unit_s{};  ///< Mean time of a unit of work.
  std::array<StageModel, 3> stage{};                   ///< Map, export, planner.
};

/// The points behind a board profile, per stage; the hold-out ones were not fitted.
struct BoardSweep {
  struct Stage {
    std::vector<governor::LatencyPoint> mean, p99, mean_hold_out, p99_hold_out;
  };
  std::array<Stage, 3> stage;
};

/// Runs map, export and planner at 6 precisions x 8 volumes from 4 poses of environment 14, `repeats` times
/// each (25 make 100 samples per point), with `backends`. Times are those of the thread: what other programs
/// take is not counted, as a flight lane has its CPU to itself. Every third volume is held out. `progress`
/// (may be empty) gets 0 .. 1.
[[nodiscard]] BoardProfile measure_board(const BackendNames& backends, int repeats,
                                         const std::function<void(double)>& progress, BoardSweep& sweep);

[[nodiscard]] std::string to_toml(const BoardProfile& board);
/// Throws InputError with file, line and key.
[[nodiscard]] BoardProfile board_from_toml(const std::string& path, const std::string& text);

/// A machine `factor` times slower than the board. The own stages are charged by the work that they count;
/// those of other libraries, which count rays and leaves of any size, by the mean model of their volume.
[[nodiscard]] Profile to_profile(const BoardProfile& board, double factor);

/// The authors' machine; the governor's model is the profile itself.
[[nodiscard]] Profile paper();
/// This machine, from `path`. A missing file is measured (seconds, minutes for other libraries' stages) and
/// written, which `note` says, because a run must repeat; one that cannot be written is used for this run
/// only. Throws InputError for a malformed file, and for one of other backends.
[[nodiscard]] Profile host(const std::string& path, const BackendNames& backends, double factor,
                           std::string& note);
/// The costs of this machine from the file of default_host_path(), with the own parts in the place of plugins;
/// nothing if it was not measured yet, or the file is of no use.
[[nodiscard]] std::optional<core::CostProfile> known_host_costs(BackendNames backends);
/// "paper", "host" (from its default path), "cortex-a72" (shipped: an estimate), or the path of a board file.
/// paper charges by volume, whatever computes; the others what `backends` cost. Throws InputError,
/// also for a board that was measured with other backends.
[[nodiscard]] Profile load_profile(const std::string& name, const BackendNames& backends);
/// $XDG_CACHE_HOME/roborun/host.toml, or below $HOME/.cache, or in the working folder; for other backends
/// than the own ones, host-MAP-PLANNER.toml. Throws InputError for a plugin.
[[nodiscard]] std::string default_host_path(const BackendNames& backends);

}  // namespace roborun::board
