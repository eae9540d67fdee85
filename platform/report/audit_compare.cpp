#include "platform/report/audit_compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "platform/input/json_reader.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kResolution_us = 10.0;
constexpr double kSignificant = 0.05;

/// What was flown: figures of other flights are not comparable.
constexpr std::array kFlown{"rate_Hz",         "asked_seconds",  "interrupted", "environment",    "seed",
                            "profile",         "profile_digest", "vehicle",     "vehicle_digest", "settings",
                            "settings_digest", "load",           "bus",         "kill_lines",     "injected",
                            "real_time"};
/// What the two sides of a comparison are expected to differ in.
constexpr std::array kProgram{"commit", "program_digest"};
constexpr std::array kOfTheRun{"command", "date"};

bool is_one_of(const auto& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Json parse(const std::string& text) {
  Json j;
  try {
    j = input::parse_json(text);
  } catch (const InputError& error) {
    throw std::invalid_argument(fmt::format("is not the JSON of an audit: {}", error.what()));
  }
  if (!j.is_object() || !j.contains("slots") || !j.contains("lanes"))
    throw std::invalid_argument("is not the JSON of an audit");
  if (!j.contains("verdict"))
    throw std::invalid_argument("is of an audit that did not write down what was flown: must be flown again");
  return j;
}

/// One figure of one run.
struct Figure {
  std::string name;
  double value{};
  double slack{};
  bool is_count{};  ///< Without noise: none is allowed to come in.
};

std::vector<Figure> figures_of(const Json& audit) {
  std::vector<Figure> all;
  const auto add = [&all](std::string name, const Json& value, double slack, bool is_count = false) {
    if (value.is_number()) all.push_back({std::move(name), value.get<double>(), slack, is_count});
  };
  add("heap calls", audit.at("heap_calls_after_start"), 0.0, true);
  for (const char* kind : {"minor", "major"})
    add(fmt::format("{} page faults", kind), audit.at("page_faults").at(kind), 0.0, true);
  add("locked bytes", audit.at("locked_bytes"), 0.0);
  for (const Json& lane : audit.at("lanes")) {
    const std::string name = lane.at("name");
    // One a thousand frames is the resolution.
    add(name + " misses per 1000",
        1000.0 * lane.at("deadline_misses").get<double>() / std::max(1.0, lane.at("frames").get<double>()),
        1.0);
    for (const char* key : {"median", "p99", "p999"})
      add(fmt::format("{} jitter {}", name, key), lane.at("wakeup_jitter_us").at(key), kResolution_us);
    for (const char* key : {"median", "p99", "p999"})
      add(fmt::format("{} response {}", name, key), lane.at("response_us").at(key), kResolution_us);
  }
  for (const Json& slot : audit.at("slots")) {
    for (const char* key : {"median_us", "p99_us", "max_us"})
      add(fmt::format("{} {}", slot.at("name").get<std::string>(), key), slot.at(key), kResolution_us);
  }
  return all;
}

std::vector<double> values_of(const std::vector<std::vector<Figure>>& runs, const std::string& name) {
  std::vector<double> values;
  for (const std::vector<Figure>& run : runs) {
    for (const Figure& f : run)
      if (f.name == name) values.push_back(f.value);
  }
  return values;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

/// What two runs must agree in and do not, with both values.
std::vector<std::string> differences(const Json& a, const Json& b, const auto& names) {
  std::vector<std::string> lines;
  for (const char* name : names) {
    const Json x = a.at("identity").value(name, Json()), y = b.at("identity").value(name, Json());
    if (x != y) lines.push_back(fmt::format("{}: {} and {}", name, x.dump(), y.dump()));
  }
  return lines;
}

void note_identity(const Json& a, const Json& b, Comparison& out) {
  const auto text = [](const Json& audit, const char* key) {
    const Json value = audit.at("identity").value(key, Json());
    return value.is_string() ? value.get<std::string>() : value.dump();
  };
  out.notes.push_back(fmt::format("commit {} of {}, against {} of {}", text(a, "commit"), text(a, "date"),
                                  text(b, "commit"), text(b, "date")));
  for (const auto& [key, value] : a.at("identity").items()) {
    const Json other = b.at("identity").value(key, Json());
    const bool expected = is_one_of(kFlown, key) || is_one_of(kProgram, key) || is_one_of(kOfTheRun, key);
    if (value != other && !expected)
      out.notes.push_back(fmt::format("{} differs: {} and {}", key, value.dump(), other.dump()));
  }
}

void judge_row(const Figure& figure, std::vector<double> a, std::vector<double> b, double tolerance_ratio,
               bool noise_known, Comparison& out) {
  if (a.empty() || b.empty()) return;
  const double x = figure.is_count ? *std::max_element(a.begin(), a.end()) : median(a);
  const double y = figure.is_count ? *std::max_element(b.begin(), b.end()) : median(b);
  const bool tested = noise_known && !figure.is_count && a.size() > 2 && b.size() > 2;
  const double p = tested ? rank_test(a, b) : 0.0;
  const bool worse = y > x * tolerance_ratio + figure.slack && p <= kSignificant;
  out.table += fmt::format("{:<34} {:>12.1f} {:>12.1f} {:>7} {}\n", figure.name, x, y,
                           tested ? fmt::format("{:.3f}", p) : "-", worse ? "WORSE" : "");
  if (worse) out.worse.push_back(fmt::format("{}: {:.1f} was {:.1f}", figure.name, y, x));
}

}  // namespace

double rank_test(std::span<const double> before, std::span<const double> after) {
  if (before.empty() || after.empty()) return 1.0;
  std::vector<std::pair<double, bool>> all;
  for (const double v : before) all.emplace_back(v, false);
  for (const double v : after) all.emplace_back(v, true);
  std::sort(all.begin(), all.end());
  // Twice the midranks, so that they are whole numbers.
  std::vector<std::size_t> rank(all.size());
  for (std::size_t i = 0; i < all.size();) {
    std::size_t end = i;
    while (end < all.size() && all[end].first == all[i].first) ++end;
    for (std::size_t k = i; k < end; ++k) rank[k] = i + end + 1;
    i = end;
  }
  std::size_t observed = 0, total = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    total += rank[i];
    if (all[i].second) observed += rank[i];
  }
  // ways[k][s]: how many choices of k of the runs have the rank sum s.
  const std::size_t chosen = after.size();
  std::vector<std::vector<double>> ways(chosen + 1, std::vector<double>(total + 1, 0.0));
  ways[0][0] = 1.0;
  for (const std::size_t r : rank) {
    for (std::size_t k = chosen; k > 0; --k)
      for (std::size_t s = total; s >= r; --s) ways[k][s] += ways[k - 1][s - r];
  }
  double as_extreme = 0.0, of_all = 0.0;
  for (std::size_t s = 0; s <= total; ++s) {
    of_all += ways[chosen][s];
    if (s >= observed) as_extreme += ways[chosen][s];
  }
  return as_extreme / of_all;
}

Comparison compare_audits(std::span<const std::string> before, std::span<const std::string> after,
                          double tolerance_ratio) {
  if (before.empty() || after.empty()) throw std::invalid_argument("is not the JSON of an audit");
  Comparison out;
  std::vector<Json> runs;
  for (const std::string& text : before) runs.push_back(parse(text));
  for (const std::string& text : after) runs.push_back(parse(text));
  try {
    for (std::size_t i = 1; i < runs.size(); ++i) {
      const bool is_first_after = i == before.size();
      const Json& same_side = runs[i < before.size() ? 0 : before.size()];
      std::vector<std::string> lines = differences(runs[0], runs[i], kFlown);
      if (!is_first_after) {
        const std::vector<std::string> others = differences(same_side, runs[i], kProgram);
        lines.insert(lines.end(), others.begin(), others.end());
      }
      for (std::string& line : lines)
        if (!is_one_of(out.not_comparable, line)) out.not_comparable.push_back(std::move(line));
    }
    if (!out.not_comparable.empty()) return out;
    note_identity(runs[0], runs[before.size()], out);
    const bool noise_known = before.size() > 2 && after.size() > 2;
    out.notes.push_back(
        noise_known
            ? fmt::format("medians of {} and {} runs; p: exact one-sided rank test, WORSE only at {} or less",
                          before.size(), after.size(), kSignificant)
            : "the noise is not known: what two runs of the same program differ by may be called WORSE; give "
              "three runs a side or more");
    std::vector<std::vector<Figure>> a, b;
    for (std::size_t i = 0; i < runs.size(); ++i) (i < before.size() ? a : b).push_back(figures_of(runs[i]));
    out.table = fmt::format("{:<34} {:>12} {:>12} {:>7}\n", "", "before", "after", "p");
    for (const Figure& figure : a.front())
      judge_row(figure, values_of(a, figure.name), values_of(b, figure.name), tolerance_ratio, noise_known,
                out);
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("is not the JSON of an audit: ") + error.what());
  }
  return out;
}

}  // namespace roborun::report
