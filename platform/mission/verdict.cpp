#include "platform/mission/verdict.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace roborun::mission {
namespace {

/// "the failsafe chose land at 7.88 s (mission; gnss)".
std::string words_of_action(const report::FailsafeRecord& r) {
  return fmt::format(
      "the failsafe chose {} at {:.2f} s ({}; {}{}{})", r.action, r.time_s, r.phase,
      r.conditions.empty() ? "no condition held any more" : fmt::format("{}", fmt::join(r.conditions, ", ")),
      r.sensor.empty() ? "" : "; ", r.sensor);
}

/// The checks of one flight, in the order of the header.
class Judgement {
 public:
  Judgement(const Scenario& scenario, const report::MissionReport& report)
      : expect_(scenario.expect), scenario_(scenario), report_(report), safety_(report.safety) {}

  std::vector<Check> all() {
    outcome();
    const bool left = safety_.left_fence_s >= 0.0;
    const Vector3& p_W = safety_.left_fence_W;
    add("fence", !left, left ? "outside" : "inside", "inside", safety_.left_fence_s,
        left ? fmt::format("at ({:.1f}, {:.1f}, {:.1f}) m", p_W.x(), p_W.y(), p_W.z()) : "");
    actions();
    faults();
    landing();
    return std::move(checks_);
  }

 private:
  void add(const char* condition, bool passed, std::string value, std::string limit, double at_s = -1.0,
           std::string why = {}) {
    checks_.push_back({condition, passed, std::move(value), std::move(limit), at_s, std::move(why)});
  }
  [[nodiscard]] std::string last_action() const {
    return safety_.actions.empty() ? "the failsafe chose nothing" : words_of_action(safety_.actions.back());
  }
  void outcome();
  void actions();
  void faults();
  void landing();

  const Expectation& expect_;
  const Scenario& scenario_;
  const report::MissionReport& report_;
  const report::SafetyRecord& safety_;
  std::vector<Check> checks_;
};

void Judgement::outcome() {
  const std::string& reason = report_.result.reason;
  const bool any_safe = expect_.outcome.empty();
  const bool safe = !report_.result.collided &&
                    std::find(kSafeOutcomes.begin(), kSafeOutcomes.end(), reason) != kSafeOutcomes.end();
  std::string why = safety_.end;
  if (!safety_.actions.empty()) why += (why.empty() ? "" : "; ") + last_action();
  add("outcome", any_safe ? safe : reason == expect_.outcome, reason,
      any_safe ? fmt::format("{}", fmt::join(kSafeOutcomes, ", ")) : expect_.outcome,
      report_.result.mission_time_s, std::move(why));
}

void Judgement::actions() {
  const std::vector<report::FailsafeRecord>& actions = safety_.actions;
  if (expect_.action) {
    const std::string action = actions.empty() ? "go_on" : actions.back().action;
    add("action", action == *expect_.action, action, *expect_.action,
        actions.empty() ? -1.0 : actions.back().time_s, last_action());
  }
  if (expect_.condition) {
    const auto saw = std::find_if(actions.begin(), actions.end(), [this](const report::FailsafeRecord& r) {
      return std::find(r.conditions.begin(), r.conditions.end(), *expect_.condition) != r.conditions.end();
    });
    const bool passed = saw != actions.end();
    add("condition", passed, passed ? *expect_.condition : "never held when an action was chosen",
        *expect_.condition, passed ? saw->time_s : -1.0, last_action());
  }
  if (expect_.sensor) {
    std::vector<std::string> named;
    for (const report::FailsafeRecord& r : actions)
      if (!r.sensor.empty()) named.push_back(fmt::format("\"{}\"", r.sensor));
    const bool passed = std::any_of(actions.begin(), actions.end(),
                                    [this](const auto& r) { return r.sensor == *expect_.sensor; });
    add("sensor", passed, named.empty() ? "none was named" : fmt::format("{}", fmt::join(named, ", ")),
        fmt::format("\"{}\"", *expect_.sensor), -1.0, last_action());
  }
}

void Judgement::faults() {
  const double fault_s = safety_.first_fault_s;
  const bool faulted = fault_s >= 0.0;
  if (!scenario_.config.faults.empty())
    add("fault", faulted, faulted ? "injected" : "never injected", "injected", fault_s,
        faulted ? "" : "the flight ended before its time in its phase came");
  if (!faulted) return;
  if (expect_.within_s) {
    const auto acted = std::find_if(safety_.actions.begin(), safety_.actions.end(),
                                    [fault_s](const auto& r) { return r.time_s >= fault_s; });
    const bool any = acted != safety_.actions.end();
    add("within_s", any && acted->time_s - fault_s <= *expect_.within_s,
        any ? fmt::format("first action {:.3f} s after the fault", acted->time_s - fault_s)
            : "no action after the fault",
        fmt::format("within {:g} s", *expect_.within_s), any ? acted->time_s : -1.0,
        fmt::format("the fault began at {:.2f} s{}", fault_s, any ? "; " + words_of_action(*acted) : ""));
  }
  if (expect_.motors_stop_within_s) {
    const double after_s = safety_.last_thrust_s - fault_s;
    add("motors_stop_within_s", after_s <= *expect_.motors_stop_within_s,
        fmt::format("motors turned until {:.4f} s after the fault", after_s),
        fmt::format("within {:g} s", *expect_.motors_stop_within_s), safety_.last_thrust_s,
        fmt::format("the fault began at {:.2f} s", fault_s));
  }
}

void Judgement::landing() {
  if (expect_.touchdown_mps)
    add("touchdown_mps", safety_.touchdown_mps <= *expect_.touchdown_mps,
        fmt::format("{:.2f} m/s", safety_.touchdown_mps),
        fmt::format("at most {:g} m/s", *expect_.touchdown_mps), safety_.touchdown_s);
  if (expect_.home_within_m && !report_.path.empty()) {
    const Vector3 away_W = safety_.end_W - report_.path.front().p_WB;
    const double away_m = std::hypot(away_W.x(), away_W.y());
    add("home_within_m", away_m <= *expect_.home_within_m, fmt::format("{:.1f} m from home", away_m),
        fmt::format("within {:g} m", *expect_.home_within_m), report_.result.mission_time_s,
        fmt::format("it ended at ({:.1f}, {:.1f}, {:.1f}) m", safety_.end_W.x(), safety_.end_W.y(),
                    safety_.end_W.z()));
  }
  if (expect_.landing_site_known)
    add("landing_site_known", *expect_.landing_site_known == safety_.landing_site_was_known,
        safety_.landing_site_was_known ? "known to be free" : "not known to be free",
        *expect_.landing_site_known ? "known to be free" : "not known to be free");
}

}  // namespace

std::vector<Check> checks_of(const Scenario& scenario, const report::MissionReport& report) {
  return Judgement(scenario, report).all();
}

std::string to_text(const Check& c) {
  return fmt::format("{}: {}{}, must be {}{}{}", c.condition, c.value,
                     c.at_s >= 0.0 ? fmt::format(" at {:.2f} s", c.at_s) : "", c.limit,
                     c.why.empty() ? "" : ": ", c.why);
}

std::vector<std::string> complaints_of(const std::vector<Check>& checks) {
  std::vector<std::string> texts;
  for (const Check& c : checks)
    if (!c.passed) texts.push_back(to_text(c));
  return texts;
}

std::vector<std::string> complaints_of(const Scenario& scenario, const report::MissionReport& report) {
  return complaints_of(checks_of(scenario, report));
}

double moment_of(const std::vector<Check>& checks, const report::MissionReport& report) {
  if (report.decisions.empty()) return 0.0;
  double at_s = report.result.mission_time_s;
  for (const Check& c : checks)
    if (!c.passed && c.at_s >= 0.0) at_s = std::min(at_s, c.at_s);
  if (!report.safety.actions.empty()) at_s = std::min(at_s, report.safety.actions.front().time_s);
  at_s = std::clamp(at_s, report.decisions.front().time_s, report.decisions.back().time_s);
  return std::ceil(100.0 * at_s - 1e-6) /
         100.0;  // or it would be printed as a moment before the first decision
}

nlohmann::json to_json(const Check& c) {
  nlohmann::json j{{"condition", c.condition}, {"passed", c.passed}, {"value", c.value}, {"limit", c.limit}};
  j["at_s"] = c.at_s >= 0.0 ? nlohmann::json(c.at_s) : nlohmann::json(nullptr);
  if (!c.why.empty()) j["why"] = c.why;
  return j;
}

LogVerdict log_verdict(const std::string& scenario, const std::vector<Check>& checks,
                       const report::MissionReport& report) {
  const std::vector<std::string> complaints = complaints_of(checks);
  nlohmann::json all = nlohmann::json::array();
  for (const Check& c : checks) all.push_back(to_json(c));
  nlohmann::json j{{"scenario", scenario},
                   {"passed", complaints.empty()},
                   {"complaints", complaints},
                   {"checks", std::move(all)}};
  if (!complaints.empty()) j["moment_s"] = moment_of(checks, report);
  return {complaints.empty(), j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
          complaints.empty() ? fmt::format("scenario {} passed", scenario)
                             : fmt::format("scenario {} FAILED: {}", scenario, fmt::join(complaints, "; "))};
}

}  // namespace roborun::mission
