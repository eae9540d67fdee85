#include "platform/app/solve_command.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "governor/solver/certificate.hpp"
#include "platform/app/exit_code.hpp"
#include "platform/board/board_profile.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::app {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Python's NaN, Infinity and -Infinity, outside of strings, into strings.
std::string quote_literals(const std::string& text) {
  std::string quoted;
  bool inside = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"' && (i == 0 || text[i - 1] != '\\')) inside = !inside;
    bool found = false;
    for (const std::string_view word : {"-Infinity", "Infinity", "NaN"}) {
      if (inside || found || text.compare(i, word.size(), word) != 0) continue;
      quoted += fmt::format("\"{}\"", word);
      i += word.size() - 1;
      found = true;
    }
    if (!found) quoted += text[i];
  }
  return quoted;
}

class Problem {
 public:
  Problem(const Json& json, std::size_t number) : json_(json), number_(number) {
    if (!json.is_object()) refuse("", "must be an object with the keys of roborun solve --help");
    static const std::set<std::string> known{"delta_d_s", "q",           "profile",         "p_min_m",
                                             "levels",    "g_min_m",     "g_avg_m",         "d_obs_m",
                                             "v_map_m3",  "v_sensor_m3", "v_planner_max_m3"};
    for (const auto& [key, value] : json.items()) {
      if (known.count(key) == 0)
        refuse(key, fmt::format("unknown key: must be one of {}", fmt::join(known, ", ")));
    }
  }

  [[nodiscard]] governor::SolverProblem read(bool& finite_model) const {
    governor::SolverProblem p;
    p.delta_d_s = number("delta_d_s");
    p.p_min_m = number_or("p_min_m", kPublishedCell_m);
    const double levels = number_or("levels", kPrecisionLevels);
    if (!(levels >= 1 && levels <= kPrecisionLevels) || levels != std::floor(levels))
      refuse("levels", fmt::format("must be a whole number from 1 to {}", kPrecisionLevels));
    p.levels = static_cast<int>(levels);
    p.g_min_m = number_or("g_min_m", 0.0);
    p.g_avg_m = number_or("g_avg_m", kInfinity);
    p.d_obs_m = number_or("d_obs_m", kInfinity);
    p.v_sensor_m3 = number("v_sensor_m3");
    p.v_map_m3 = number("v_map_m3");
    p.v2_max_m3 = number("v_planner_max_m3");
    p.v0_max_m3 = kInfinity;
    p.v1_max_m3 = kInfinity;
    finite_model = true;
    if (json_.contains("q") == json_.contains("profile"))
      refuse("q", "give either q (3 rows of 4 numbers) or profile (paper, or a board file)");
    if (json_.contains("profile")) {
      if (!json_["profile"].is_string()) refuse("profile", "must be paper or the path of a board file");
      p.model = board::load_profile(json_["profile"].get<std::string>(), {}).model;
      return p;
    }
    const Json& q = json_["q"];
    if (!q.is_array() || q.size() != 3) refuse("q", "must be 3 rows of 4 numbers");
    for (std::size_t i = 0; i < 3; ++i) {
      if (!q[i].is_array() || q[i].size() != 4) refuse("q", "must be 3 rows of 4 numbers");
      governor::Eq4 eq4;
      for (std::size_t k = 0; k < 4; ++k) {
        eq4.q[k] = value(q[i][k], "q");
        finite_model = finite_model && eq4.q[k] >= 0.0 && eq4.q[k] < kInfinity;
      }
      p.model[i] = governor::from_eq4(eq4, p.p_min_m);
    }
    return p;
  }

 private:
  [[noreturn]] void refuse(const std::string& key, const std::string& what) const {
    throw InputError(fmt::format("problem {}: {}{}{}", number_, key, key.empty() ? "" : ": ", what));
  }
  [[nodiscard]] double value(const Json& json, const char* key) const {
    if (json.is_number()) return json.get<double>();
    if (json.is_null() || json == "NaN") return std::numeric_limits<double>::quiet_NaN();
    if (json == "Infinity") return kInfinity;
    if (json == "-Infinity") return -kInfinity;
    refuse(key, "must be a number");
  }
  [[nodiscard]] double number(const char* key) const {
    if (!json_.contains(key)) refuse(key, "missing");
    return value(json_[key], key);
  }
  [[nodiscard]] double number_or(const char* key, double fallback) const {
    return json_.contains(key) ? value(json_[key], key) : fallback;
  }

  const Json& json_;
  std::size_t number_;
};

Json answer(const Json& json, std::size_t number) {
  bool finite_model = true;
  const governor::SolverProblem p = Problem(json, number).read(finite_model);
  const governor::SolverSolution s = finite_model ? governor::solve(p) : governor::SolverSolution{};
  const auto cell_m = [&p](int level) { return p.p_min_m * static_cast<double>(1 << level); };
  Json out;
  if (s.status == Status::kInvalidArgument) {
    out["status"] = "invalid";
    out["why"] = finite_model ? "a bound or the time is NaN, or p_min_m is not above 0"
                              : "a coefficient of q is negative, infinite or NaN";
    for (const char* key : {"p_m", "v_m3", "latency_s", "objective"}) out[key] = nullptr;
    out["active"] = Json::array();
    out["multipliers"] = Json::object();
    return out;
  }
  out["status"] = s.status == Status::kOk ? "ok" : "infeasible";
  out["p_m"] = {cell_m(s.p0_level), cell_m(s.p1_level), cell_m(s.p1_level)};
  out["v_m3"] = {s.v0_m3, s.v1_m3, s.v2_m3};
  out["latency_s"] = s.latency_s;
  out["objective"] = s.objective_s2;
  out["active"] = Json::array();
  out["multipliers"] = Json::object();
  for (std::size_t i = 0; i < governor::kConstraintCount; ++i) {
    const char* name = governor::to_string(static_cast<governor::Constraint>(i));
    if (((s.active >> i) & 1U) != 0) out["active"].push_back(name);
    out["multipliers"][name] = s.multiplier[i];
  }
  for (const governor::Reason reason : governor::kReasons) {
    if ((s.active & reason) != 0) out["active"].push_back(governor::to_string(reason));
  }
  out["certificate"] = governor::to_string(governor::verify(p, s));
  return out;
}

}  // namespace

std::string solve_json(const std::string& text) {
  Json problems;
  try {
    problems = input::parse_json(quote_literals(text));
  } catch (const InputError& error) {
    throw InputError(fmt::format("standard input: {}", error.what()));
  }
  if (!problems.is_array()) return answer(problems, 1).dump();
  Json output = Json::array();
  for (std::size_t i = 0; i < problems.size(); ++i) output.push_back(answer(problems[i], i + 1));
  return output.dump();
}

void add_solve_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* command =
      app.add_subcommand("solve", "Answer Eq. 3: precision and volume of each stage for a time");
  command->footer(
      "Reads one problem or a list of problems as JSON from standard input. Keys:\n"
      "  delta_d_s              time for the three stages together (map, export, planner), s\n"
      "  q                      3 rows of 4: latency_i = (q0 / p^3 + q1 / p^2 + q2 / p) * q3 * v\n"
      "  profile                instead of q: paper, or a file that roborun calibrate wrote\n"
      "  v_sensor_m3, v_map_m3  upper bounds of v1 (and v0 <= v1)\n"
      "  v_planner_max_m3       upper bound of v2\n"
      "  g_min_m [0], g_avg_m [none], d_obs_m [none]   bounds of p0\n"
      "  p_min_m [0.3], levels [6]                     the lattice p_min * 2^k\n"
      "Prints knobs, latency, objective (s2), active constraints, multipliers, and what an independent "
      "checker says.\n\n"
      "Example:\n"
      "  echo '{\"delta_d_s\": 0.8, \"profile\": \"paper\", \"g_avg_m\": 2, \"d_obs_m\": 3, \"v_sensor_m3\": "
      "30000,\n"
      "         \"v_map_m3\": 90000, \"v_planner_max_m3\": 12000}' | roborun solve --json");
  const auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "One line of JSON (the default is indented for people)");
  command->callback([json, &run] {
    run = [json] {
      input::InputFile in = input::InputFile::standard_input();
      const std::string line = solve_json(input::read_text(in, "one problem, or a list of them"));
      fmt::print("{}\n", *json ? line : Json::parse(line).dump(2));
      return kDone;
    };
  });
}

}  // namespace roborun::app
