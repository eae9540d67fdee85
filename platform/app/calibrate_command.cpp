#include "platform/app/calibrate_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/board/stopping_sweep.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/report/calibration_plot.hpp"
#include "platform/report/progress_line.hpp"
#include "platform/report/trace_csv.hpp"

namespace roborun::app {
namespace {

struct CalibrateOptions {
  std::string out;
  std::string plot;
  board::BackendNames backends{};
  int repeats{25};
  bool stopping{false};
  bool json{false};
};

constexpr std::array<double, 12> kSpeeds_mps{0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0};
constexpr std::array<const char*, 3> kTitle{"map integration", "map export", "planner"};
constexpr std::array<const char*, 3> kKey{"map", "export", "planner"};

void write(const std::string& path, const std::string& text) {
  if (!path.empty()) input::write_file(path, text);
}

std::string plot_of(const board::BoardProfile& board, const board::BoardSweep& sweep) {
  std::vector<report::CalibrationPanel> panels;
  for (const bool p99 : {false, true}) {
    for (std::size_t i = 0; i < 3; ++i) {
      const board::StageModel& stage = board.stage[i];
      const board::BoardSweep::Stage& points = sweep.stage[i];
      const governor::LatencyModel& model = p99 ? stage.p99 : stage.mean;
      report::CalibrationPanel panel{
          fmt::format("{}, {}: {:.1f} % off", kTitle[i], p99 ? "p99" : "mean",
                      100.0 * (p99 ? stage.p99_error : stage.mean_error).mean_relative),
          {}};
      for (int level = 0; level < kPrecisionLevels; ++level) {
        const auto k = static_cast<std::size_t>(level);
        report::CalibrationCurve curve{
            PrecisionLattice{}.cell_size_m(level), model.fixed_s[k], model.slope_s_per_m3[k], {}};
        const auto take = [&](const std::vector<governor::LatencyPoint>& from, bool hold_out) {
          for (const governor::LatencyPoint& p : from) {
            if (p.level == level) curve.points.push_back({p.volume_m3, p.latency_s, hold_out});
          }
        };
        take(p99 ? points.p99 : points.mean, false);
        take(p99 ? points.p99_hold_out : points.mean_hold_out, true);
        panel.curves.push_back(std::move(curve));
      }
      panels.push_back(std::move(panel));
    }
  }
  return report::calibration_svg(fmt::format("What the stages cost on {}", board.machine), panels);
}

int calibrate_board(const CalibrateOptions& options) {
  board::BoardSweep sweep;
  board::BoardProfile board;
  {
    report::ProgressLine line;
    board = board::measure_board(
        options.backends, options.repeats,
        [&line](double done) {
          line.show(fmt::format("measuring map, export and planner: {:3.0f} %, {:.0f} s left", 100.0 * done,
                                line.elapsed_s() * (1.0 - done) / done));
        },
        sweep);
  }
  write(options.out, board::to_toml(board));
  write(options.plot, plot_of(board, sweep));
  if (options.json) {
    nlohmann::ordered_json json;
    json["machine"] = board.machine;
    json["samples_a_point"] = 4 * options.repeats;
    for (std::size_t i = 0; i < 3; ++i) {
      const board::StageModel& s = board.stage[i];
      json["stages"][kKey[i]] = {{"mean_error_ratio", s.mean_error.mean_relative},
                                 {"mean_error_max_ratio", s.mean_error.max_relative},
                                 {"p99_error_ratio", s.p99_error.mean_relative},
                                 {"p99_error_max_ratio", s.p99_error.max_relative}};
    }
    fmt::print("{}\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return kDone;
  }
  fmt::print("{}, {} samples per point, thread time; error on points that were not fitted:\n", board.machine,
             4 * options.repeats);
  fmt::print("{:<10} {:>12} {:>12} {:>12} {:>12}\n", "stage", "mean: avg %", "max %", "p99: avg %", "max %");
  for (std::size_t i = 0; i < 3; ++i) {
    const board::StageModel& s = board.stage[i];
    fmt::print("{:<10} {:>12.1f} {:>12.1f} {:>12.1f} {:>12.1f}\n", kKey[i],
               100.0 * s.mean_error.mean_relative, 100.0 * s.mean_error.max_relative,
               100.0 * s.p99_error.mean_relative, 100.0 * s.p99_error.max_relative);
  }
  if (!options.plot.empty()) fmt::print("picture: {}\n", options.plot);
  if (!options.out.empty()) {
    fmt::print("board profile: {0}\nfly with it: roborun fly --profile {0}", options.out);
    if (options.backends.map != "own") fmt::print(" --map {}", options.backends.map);
    if (options.backends.planner != "own") fmt::print(" --planner {}", options.backends.planner);
    fmt::print("\n");
  }
  return kDone;
}

int calibrate_stopping(const CalibrateOptions& options) {
  std::vector<board::StoppingPoint> points;
  {
    report::ProgressLine line;
    points = board::stopping_sweep(kSpeeds_mps, 8, [&line](double done) {
      line.show(fmt::format("braking from {} speeds: {:3.0f} %", kSpeeds_mps.size(), 100.0 * done));
    });
  }
  const board::StoppingFit fit = board::fit_stopping(points);
  const StoppingModel& m = fit.model;
  std::string toml = fmt::format(
      "# How far the simulated quadrotor travels until it stands; written by roborun calibrate --stopping.\n"
      "[stopping]\nquadratic_s2pm = {:.6f}\nlinear_s = {:.6f}\nconstant_m = {:.6f}\n",
      m.quadratic_s2pm, m.linear_s, m.constant_m);
  write(options.out, toml);
  if (options.json) {
    nlohmann::ordered_json json;
    for (const board::StoppingPoint& p : points) json["points"].push_back({p.speed_mps, p.distance_m});
    json["quadratic_s2pm"] = m.quadratic_s2pm;
    json["linear_s"] = m.linear_s;
    json["constant_m"] = m.constant_m;
    json["mean_squared_relative_error"] = fit.mean_squared_relative;
    fmt::print("{}\n", json.dump());
    return kDone;
  }
  fmt::print("{:>8} {:>11} {:>9} {:>9}\n", "v, m/s", "stop, m", "fit, m", "used, m");
  for (const board::StoppingPoint& p : points) {
    fmt::print("{:>8.1f} {:>11.3f} {:>9.3f} {:>9.3f}\n", p.speed_mps, p.distance_m, m.distance_m(p.speed_mps),
               kSitlQuadrotorStopping.distance_m(p.speed_mps));
  }
  fmt::print("d_stop = {:.4f} v^2 + {:.4f} v + {:.4f}, relative mean squared error {:.2f} %\n",
             m.quadratic_s2pm, m.linear_s, m.constant_m, 100.0 * fit.mean_squared_relative);
  return kDone;
}

}  // namespace

void add_calibrate_command(CLI::App& app, std::function<int()>& run) {
  const auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command = app.add_subcommand("calibrate", "Measure what the stages cost on this machine");
  command->footer(
      "Sweeps 6 precisions x 8 volumes of map integration, export and planning, fits a non-negative, "
      "monotone latency\n"
      "model to the mean and to the 99th percentile of each stage, and says how far it is from points it has "
      "not seen.\n\n"
      "Examples:\n"
      "  roborun calibrate --out board.toml --plot board.svg    then: roborun fly --profile board.toml\n"
      "  roborun calibrate --map octomap --planner ompl:RRTstar --out stock.toml    what the baseline costs\n"
      "  roborun calibrate --stopping                           braking distance of the simulated vehicle");
  command->add_option("--out", options->out, "Write the board profile to this TOML file");
  CLI::Option* plot =
      command->add_option("--plot", options->plot, "Draw points and models into this SVG file");
  CLI::Option* map = command->add_option("--map", options->backends.map, "own, octomap, or plugin:FILE.so")
                         ->capture_default_str();
  CLI::Option* planner = command
                             ->add_option("--planner", options->backends.planner,
                                          "own, ompl:NAME such as ompl:RRTstar, or plugin:FILE.so")
                             ->capture_default_str();
  CLI::Option* repeats = add_whole(*command, "--repeats", options->repeats, 1, 1000,
                                   "Passes over the sweep, 1 .. 1000; a point gets 4 samples in each");
  command->add_flag("--stopping", options->stopping,
                    "Fly the speed sweep instead and fit the braking distance");
  command->add_flag("--json", options->json, "One line of JSON instead of the table");
  command->callback([=, &run] {
    for (const CLI::Option* option : {plot, map, planner, repeats})
      refuse_alone(*option, !options->stopping, "a run without --stopping");
    run = [options] {
      const auto plugin = [](const std::string& name) { return name.substr(name.find(':') + 1); };
      input::check_outputs({{"--out", options->out}, {"--plot", options->plot}},
                           {plugin(options->backends.map), plugin(options->backends.planner)});
      return options->stopping ? calibrate_stopping(*options) : calibrate_board(*options);
    };
  });
}

}  // namespace roborun::app
