#include <fmt/format.h>
#include <fmt/ranges.h>

#include "platform/evaluation/sweep_run.hpp"
#include "platform/input/arguments.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/mission/scene.hpp"
#include "platform/report/evaluation_table.hpp"
#include "platform/report/flight_record.hpp"
#include "platform/report/suite_summary.hpp"
#include "platform/report/svg.hpp"
#include "platform/report/sweep_plot.hpp"
#include "platform/report/trace_csv.hpp"
#include "platform/sitl/world/generator.hpp"

namespace roborun::evaluation {
namespace {

constexpr const char* kStyle =
    "body{font-family:Helvetica,Arial,sans-serif;color:#1f2933;margin:2em auto;max-width:1420px;padding:0 "
    "1em}"
    "pre{background:#f7f9fb;padding:1em;overflow-x:auto}svg{max-width:100%;height:auto}"
    "@media(prefers-color-scheme:dark){body{background:#14181d;color:#e4e7eb}pre{background:#1f2933}}";

/// The flights of the representative environment.
std::vector<report::MissionReport> kept_flights(const SweepStore& store) {
  std::vector<report::MissionReport> flights;
  for (report::MissionResult& result : store.results()) {
    const SweepMission mission = mission_of_result(result);
    if (!is_representative(store.plan(), mission)) continue;
    report::MissionReport flight;
    flight.result = std::move(result);
    if (!report::from_flight_record(store.flight(mission), flight)) {
      throw InputError(
          fmt::format("{}/flight_{}_{}.json: is not the record of a flight: remove it, and sweep again",
                      store.folder(), mission.design, mission.seed));
    }
    flights.push_back(std::move(flight));
  }
  return flights;
}

/// Text of several lines for <pre>.
std::string escaped_lines(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '\n' ? std::string("\n") : report::xml_escape(std::string(1, c));
  return escaped;
}

class Page {
 public:
  Page(const SweepStore& store, const std::string& title) : store_(store) {
    html_ = fmt::format(
        "<!doctype html>\n<html lang=\"en\"><head><meta "
        "charset=\"utf-8\"><title>{0}</title><style>{1}</style>"
        "</head><body>\n<h1>{0}</h1>\n",
        report::xml_escape(title), kStyle);
  }
  /// A table on the page and in tables.txt.
  void text(const std::string& heading, const std::string& what) {
    html_ += fmt::format("<h2>{}</h2>\n<pre>{}</pre>\n", report::xml_escape(heading), escaped_lines(what));
    tables_ += fmt::format("{}{}\n\n{}", tables_.empty() ? "" : "\n\n", heading, what);
  }
  /// A picture on the page and in a file of its own.
  void picture(const std::string& heading, const std::string& file, const std::string& svg) {
    html_ += fmt::format("<h2>{}</h2>\n{}", heading, svg);
    write(file, svg);
  }
  void finish() {
    write("report.html", html_ + "</body></html>\n");
    write("tables.txt", tables_);
  }

 private:
  void write(const std::string& name, const std::string& text) {
    input::write_file(store_.folder() + "/" + name, text);
  }
  const SweepStore& store_;
  std::string html_;
  std::string tables_;
};

std::string settings_of(const SweepPlan& plan) {
  return (plan.settings.empty() ? "default" : plan.settings) + (plan.aim.empty() ? "" : ", aim " + plan.aim);
}

}  // namespace

void write_suite_report(const SweepStore& store, const std::vector<report::MissionResult>& flights) {
  const SweepPlan& plan = store.plan();
  Page page(store, fmt::format("roborun sweep, suite {}: seeds {}", plan.suite, fmt::join(plan.seeds, ", ")));
  page.text("Flights",
            fmt::format(
                "{}\nvehicles {}; map {}, planner {}, settings {}; {} of {} flights\ncommit {}, program {}\n",
                report::suite_table(flights), plan.vehicle, plan.map, plan.planner, settings_of(plan),
                flights.size(), store.missions().size(), plan.commit, plan.build));
  page.finish();
}

void write_sweep_report(const SweepStore& store) {
  const SweepPlan& plan = store.plan();
  const std::vector<report::SweepRow> rows = rows_of(store);
  std::vector<std::string> profiles;
  for (const SweepPlan::ProfileId& id : plan.profiles) profiles.push_back(id.name);
  Page page(store, fmt::format("roborun sweep {}: {} environments, seeds {}", plan.suite,
                               plan.environments.size(), fmt::join(plan.seeds, ", ")));
  page.text("Overall", fmt::format("{}\nmission {}, map {}, planner {}, settings {}; {} of {} missions\n"
                                   "commit {}, program {}\n",
                                   report::sweep_table(rows), plan.mission, plan.map, plan.planner,
                                   settings_of(plan), rows.size(), store.missions().size(),
                                   plan.commit.empty() ? "unknown" : plan.commit, plan.build));
  page.picture("Overall metrics", "overall.svg", report::overall_svg(rows));
  for (const std::string& profile : profiles) {
    page.picture(
        fmt::format("Sensitivity to the environment, profile {}", report::xml_escape(profile)),
        profiles.size() == 1 ? std::string("sensitivity.svg") : fmt::format("sensitivity_{}.svg", profile),
        report::sensitivity_svg(rows, profile));
    page.text(fmt::format("Mission time over density, spread and distance, profile {}", profile),
              report::sensitivity_table(rows, profile));
  }
  const std::vector<report::MissionReport> kept = kept_flights(store);
  std::vector<report::MissionReport> flights;
  for (const report::MissionReport& flight : kept) {
    if (flight.result.seed == plan.seeds.front()) flights.push_back(flight);
  }
  if (!flights.empty()) {
    const report::MissionResult& first = flights.front().result;
    const sitl::NamedEnvironment named = sitl::environment(first.env);
    const std::string title = fmt::format("Environment {} ({}), {}, seed {}, cost profile {}", named.number,
                                          named.name, plan.mission, first.seed, first.profile);
    const report::Scene scene = mission::scene_of(
        sitl::generate(named.knobs, sitl::mission_of(plan.mission), first.seed), title, named.knobs.spread_m);
    page.picture("A representative mission: the paths over the congestion", "representative_speed.svg",
                 report::mission_svg(scene, flights, report::PathColour::kSpeed));
    page.picture("The same, coloured by precision", "representative_precision.svg",
                 report::mission_svg(scene, flights, report::PathColour::kPrecision));
    page.picture("The same over time: where the latency goes", "representative_time.svg",
                 report::breakdown_svg(flights, scene.zone_borders_m));
    page.text(fmt::format("Environment {} ({}), all seeds", named.number, named.name),
              report::representative_table(kept, scene.zone_borders_m));
  }
  page.finish();
}

}  // namespace roborun::evaluation
