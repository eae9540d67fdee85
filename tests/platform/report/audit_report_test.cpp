#include "platform/report/audit_report.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "core/random/counter_rng.hpp"
#include "platform/report/audit_compare.hpp"
#include "platform/report/audit_verdict.hpp"
#include "platform/report/instruction_counts.hpp"
#include "platform/report/sha256.hpp"

namespace roborun::report {
namespace {

using Json = nlohmann::json;

std::vector<double> gumbel_us(std::size_t count, double location, double scale, std::uint64_t seed) {
  core::CounterRng rng(seed, 1);
  std::vector<double> x;
  for (std::size_t i = 0; i < count; ++i)
    x.push_back(location - scale * std::log(-std::log(std::clamp(rng.uniform(), 1e-12, 1.0 - 1e-12))));
  return x;
}

TEST(Pwcet, RecoversAGumbelDistribution) {
  const Pwcet p = fit_pwcet(gumbel_us(800, 100.0, 10.0, 3));
  ASSERT_TRUE(p.fitted) << p.verdict;
  EXPECT_EQ(p.verdict, "supporting evidence");
  EXPECT_NEAR(p.location_us, 100.0, 2.0);
  EXPECT_NEAR(p.scale_us, 10.0, 1.0);
  EXPECT_NEAR(p.exceeded_1e9_us, 100.0 + 10.0 * std::log(1e9), 25.0);
  EXPECT_EQ(p.observed_us.size(), 800U);
  EXPECT_LT(p.exceeded_1e9_low_us, p.exceeded_1e9_us);
  EXPECT_GT(p.exceeded_1e9_high_us, p.exceeded_1e9_us);
}

TEST(Pwcet, ItsBandHoldsTheTruthAsOftenAsItSays) {
  const double truth = 100.0 + 10.0 * std::log(1e9);
  int fitted = 0, inside = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Pwcet p = fit_pwcet(gumbel_us(300, 100.0, 10.0, seed));
    if (!p.fitted) {
      EXPECT_TRUE(p.levels.empty()) << "no plot of what was refused";
      continue;
    }
    ++fitted;
    inside += p.exceeded_1e9_low_us <= truth && truth <= p.exceeded_1e9_high_us ? 1 : 0;
  }
  ASSERT_GT(fitted, 150);
  EXPECT_GT(inside, fitted * 88 / 100);
  EXPECT_LT(inside, fitted) << "a band that holds everything says nothing";
}

TEST(Pwcet, RefusesMostSamplesOfOtherKindsAndSaysWhy) {
  std::vector<double> drifting = gumbel_us(400, 100.0, 10.0, 5);
  for (std::size_t i = 200; i < 400; ++i) drifting[i] += 40.0;
  std::vector<double> alternating = gumbel_us(400, 100.0, 10.0, 6);
  for (std::size_t i = 0; i < 400; i += 2) alternating[i] += 60.0;
  std::vector<double> two_paths = gumbel_us(400, 100.0, 1.0, 7);
  core::CounterRng rng(8, 1);
  for (double& x : two_paths) x += rng.uniform() < 0.5 ? 80.0 : 0.0;
  // The same median in both halves, so that only the comparison of halves can see it.
  std::vector<double> spreading = gumbel_us(800, 100.0, 2.0, 10);
  for (std::size_t i = 400; i < 800; ++i) spreading[i] = 100.7 + 8.0 * (spreading[i] - 100.7);
  EXPECT_NE(fit_pwcet(alternating).verdict.find("not independent"), std::string::npos);
  EXPECT_NE(fit_pwcet(spreading).verdict.find("not stationary"), std::string::npos)
      << fit_pwcet(spreading).verdict;
  EXPECT_NE(fit_pwcet(two_paths).verdict.find("no Gumbel"), std::string::npos);
  EXPECT_NE(fit_pwcet(gumbel_us(99, 1.0, 1.0, 1)).verdict.find("100 are needed"), std::string::npos);
  EXPECT_NE(fit_pwcet(std::vector<double>(200, 5.0)).verdict.find("refused"), std::string::npos);
  for (const auto& sample : {drifting, alternating, two_paths}) {
    const Pwcet p = fit_pwcet(sample);
    EXPECT_FALSE(p.fitted) << p.verdict;
    EXPECT_EQ(p.verdict.rfind("refused: ", 0), 0U) << p.verdict;
  }
}

AuditReport sample() {
  AuditReport r;
  r.seconds = 60.0;
  r.heap_sealed = true;
  r.locked_bytes = 61'000'000;
  core::DurationHistogram time;
  for (int i = 1; i <= 1000; ++i) time.add(Nanos{1000 * i});
  for (const core::LaneSpec& spec : core::kLanes) {
    AuditLane l;
    l.name = spec.name;
    l.frames = 1000;
    l.period_us = 2500.0;
    l.time_line.resize(kTimeColumns);
    l.time_line[7] = {12.0, 34.0, 5, 1};
    l.jitter = l.overhead = l.response = summarise(time);
    r.lanes.push_back(l);
  }
  r.lanes[2].minor_faults = 7;
  for (const core::SlotSpec& spec : core::kFrameTable) {
    AuditSlot s;
    s.name = spec.name;
    s.lane = core::lane(spec.lane).name;
    s.policy = "skip";
    s.time = summarise(time);
    s.budget_us = 2000.0;
    s.margin_ratio = 0.5;
    s.pwcet.verdict = "refused: <few> & far";
    r.slots.push_back(s);
  }
  r.pools = {{"map bricks", 4700, 9100, 3000, true}};
  r.identity = {{"kernel", "6.1"},
                {"cpu", "a <fast> one"},
                {"environment", "14"},
                {"commit", "abc"},
                {"program_digest", "sha256 1"}};
  using core::LaneId;
  using core::SlotId;
  const auto at = [](std::int64_t ns) { return MonotonicTime{Nanos{ns}}; };
  // As the executive tells it: pieces first, their frame after them; map and governor take turns.
  r.trace = {{at(10'000), at(12'001), at(15'003), 5, LaneId::kFlight, SlotId::kSense, false, false},
             {at(10'000), at(15'003), at(15'900), 5, LaneId::kFlight, SlotId::kTrack, false, false},
             {at(10'000), at(12'001), at(16'000), 5, LaneId::kFlight, SlotId::kTrack, true, false},
             {at(10'000), at(11'000), at(20'000), 0, LaneId::kDecision, SlotId::kMap, false, false},
             {at(10'000), at(20'000), at(21'000), 0, LaneId::kDecision, SlotId::kGovernor, false, true},
             {at(10'000), at(21'000), at(30'001), 0, LaneId::kDecision, SlotId::kMap, false, false},
             {at(10'000), at(11'000), at(30'500), 0, LaneId::kDecision, SlotId::kMap, true, true}};
  return r;
}

JudgedRequirement found(const AuditReport& r, const std::string& name,
                        const std::vector<std::string>& texts = {}) {
  for (const JudgedRequirement& j : judge(r, requirements_of(texts)))
    if (j.name == name) return j;
  ADD_FAILURE() << name << " is not required";
  return {};
}

/// A report that meets every requirement that does not need 10,000 frames.
AuditReport sound() {
  AuditReport r = sample();
  core::DurationHistogram time;
  for (int i = 0; i < 20'000; ++i) time.add(Nanos{1000 + i});
  r.lanes[0].jitter = summarise(time);
  r.requirements = judge(r, requirements_of({}));
  return r;
}

TEST(AuditReport, HasTheKeysThatMachinesRead) {
  const Json j = Json::parse(to_json(sample()));
  EXPECT_EQ(j.at("heap_calls_after_start"), 0);
  EXPECT_EQ(j.at("page_faults").at("minor"), 0) << "the background lane is not real-time";
  EXPECT_EQ(j.at("page_faults").at("major"), 0);
  EXPECT_EQ(j.at("locked_bytes"), 61'000'000);
  ASSERT_EQ(j.at("lanes").size(), core::kLaneCount);
  for (const char* key : {"name", "frames", "slips", "deadline_misses"})
    EXPECT_TRUE(j["lanes"][0].contains(key));
  for (const char* key : {"p99", "p999", "max"}) EXPECT_TRUE(j["lanes"][0]["wakeup_jitter_us"].contains(key));
  ASSERT_EQ(j.at("slots").size(), core::kSlotCount);
  for (const char* key :
       {"name", "lane", "count", "min_us", "median_us", "p99_us", "max_us", "budget_us", "margin_ratio"})
    EXPECT_TRUE(j["slots"][0].contains(key)) << key;
  EXPECT_NEAR(j["slots"][0]["median_us"].get<double>(), 500.0, 8.0);
  EXPECT_DOUBLE_EQ(j["slots"][0]["max_us"].get<double>(), 1000.0);
}

TEST(AuditReport, HtmlNeedsNothingFromOutsideAndEscapesText) {
  const std::string html = audit_html(sample());
  for (const char* request : {"<script", "http:", "https:", "src=", "@import", "url("})
    EXPECT_EQ(html.find(request), std::string::npos) << request;
  EXPECT_EQ(html.find("<few>"), std::string::npos);
  EXPECT_NE(html.find("&lt;few&gt; &amp; far"), std::string::npos);
  std::size_t plots = 0;
  for (std::size_t at = html.find("<svg"); at != std::string::npos; at = html.find("<svg", at + 1)) ++plots;
  EXPECT_EQ(plots, 3 * core::kLaneCount + core::kSlotCount) << "time line, jitter and response of lanes";
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

TEST(AuditReport, PlotsStayInTheirFrames) {
  AuditReport r = sample();
  r.slots[4].pwcet = fit_pwcet(gumbel_us(800, 100.0, 10.0, 3));
  ASSERT_TRUE(r.slots[4].pwcet.fitted);
  r.lanes[1].time_line[3].worst_response_us = 9e6;
  const std::string html = audit_html(r);
  EXPECT_NE(html.find("block maxima, fit and its 95 % band"), std::string::npos);
  std::size_t points = 0;
  for (std::size_t at = html.find("points=\""); at != std::string::npos;
       at = html.find("points=\"", at + 1)) {
    const std::size_t svg = html.rfind("viewBox=\"0 0 ", at);
    const double width = std::stod(html.substr(svg + 13)), height = 220.0;
    const std::string list = html.substr(at + 8, html.find('"', at + 8) - at - 8);
    for (std::size_t i = 0; i < list.size(); i = list.find(' ', i) + 1, ++points) {
      const double x = std::stod(list.substr(i)), y = std::stod(list.substr(list.find(',', i) + 1));
      ASSERT_TRUE(x >= 0.0 && x <= width && y >= 0.0 && y <= height) << x << " " << y << " in " << list;
    }
  }
  EXPECT_GT(points, 300U);
}

TEST(AuditReport, SlicesOfOneTrackNestAndDoNotOverlap) {
  const Json j = Json::parse(perfetto_trace(sample()));
  struct Slice {
    std::string name;
    double begin, end;
  };
  std::map<int, std::vector<Slice>> open;  // by track, the slices around the present one
  std::vector<std::string> names;
  double last = 0.0;
  for (const Json& e : j.at("traceEvents")) {
    if (e.at("ph") != "X") continue;
    const double begin = e.at("ts"), end = begin + e.at("dur").get<double>();
    names.push_back(e.at("name"));
    EXPECT_GE(begin, last) << "in order";
    last = begin;
    std::vector<Slice>& around = open[e.at("tid")];
    constexpr double kDigit_us = 5e-4;  // of the numbers in the file
    while (!around.empty() && around.back().end <= begin + kDigit_us) around.pop_back();
    if (e.at("name") == "frame") {
      EXPECT_TRUE(around.empty()) << "frames of a lane follow each other";
    } else {
      ASSERT_EQ(around.size(), 1U) << names.back() << " is in its frame and in nothing else";
      EXPECT_EQ(around.back().name, "frame");
      EXPECT_LE(end, around.back().end + kDigit_us);
    }
    around.push_back({names.back(), begin, end});
  }
  EXPECT_EQ(names, (std::vector<std::string>{"frame", "map", "frame", "sense", "track", "governor", "map"}));
}

TEST(AuditReport, SamplesAreAnArrayOfNumPy) {
  const std::string file = sample_file(sample());
  ASSERT_EQ(file.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t head = static_cast<unsigned char>(file[8]) + 256U * static_cast<unsigned char>(file[9]);
  EXPECT_EQ((10 + head) % 64, 0U);
  EXPECT_EQ(file[9 + head], '\n');
  EXPECT_NE(file.find("'shape': (7,)"), std::string::npos);
  ASSERT_EQ(file.size(), 10 + head + 7 * 32);
  std::int64_t begin_ns = 0;
  std::memcpy(&begin_ns, &file[10 + head + 16], sizeof begin_ns);
  EXPECT_EQ(begin_ns, 12'001);
  EXPECT_EQ(static_cast<unsigned char>(file[10 + head + 2 * 32 + 5]), 255U) << "a whole frame";
}

TEST(AuditReport, HistogramsAreDataAndPercentilesOnlyWhereTheCountCarriesThem) {
  const Json j = Json::parse(to_json(sample()));
  std::uint64_t sum = 0;
  std::uint64_t last = 0;
  for (const Json& row : j["slots"][0]["histogram"]) {
    EXPECT_GT(row.at(0).get<std::uint64_t>(), last);
    last = row.at(0);
    sum += row.at(1).get<std::uint64_t>();
  }
  EXPECT_EQ(sum, 1000U);
  EXPECT_EQ(j["lanes"][0]["wakeup_jitter_us"]["histogram"], j["slots"][0]["histogram"]);
  core::DurationHistogram few;
  const auto with = [&few](std::uint64_t count) {
    while (few.count() < count) few.add(Nanos{5000});
    return summarise(few);
  };
  EXPECT_FALSE(with(36).p99_us);
  EXPECT_FALSE(with(999).p99_us);
  EXPECT_TRUE(with(1000).p99_us);
  EXPECT_FALSE(with(9'999).p999_us);
  EXPECT_TRUE(with(10'000).p999_us);
  EXPECT_FALSE(with(99'999).p9999_us);
  EXPECT_TRUE(with(100'000).p9999_us);
  EXPECT_TRUE(j["slots"][0]["p9999_us"].is_null());
  EXPECT_EQ(with(100'000).histogram, (std::vector<std::pair<std::uint64_t, std::uint64_t>>{{5, 100'000}}));
}

TEST(AuditReport, TableSaysWhatIsMissing) {
  AuditReport r = sample();
  EXPECT_EQ(audit_table(r).find("NOT REAL TIME"), std::string::npos);
  r.missing = {"memory lock: no"};
  EXPECT_NE(audit_table(r).find("NOT REAL TIME"), std::string::npos);
  EXPECT_NE(audit_html(r).find("memory lock: no"), std::string::npos);
  EXPECT_EQ(Json::parse(to_json(r)).at("missing").at(0), "memory lock: no");
}

TEST(AuditReport, TellsHowCommandsReachedTheEscsOverARealBusAndOnlyThen) {
  AuditReport r = sample();
  EXPECT_FALSE(Json::parse(to_json(r)).contains("commands"));
  CommandPath& path = r.commands.emplace();
  path.interfaces = {"can0", "can1"};
  path.sent = 1000;
  path.heard = 996;
  path.lost = 3;
  path.late = 2;
  path.age.max_us = 1234.0;
  const Json commands = Json::parse(to_json(r)).at("commands");
  EXPECT_EQ(commands.at("lost"), 3);
  EXPECT_EQ(commands.at("late"), 2);
  EXPECT_EQ(commands.at("age_us").at("max"), 1234.0);
  EXPECT_NE(audit_table(r).find("commands from can0 to can1: 1000 sent, 0 refused, 3 lost, 2 late"),
            std::string::npos);
}

TEST(Verdict, PassesWhatMeetsEveryRequirementAndSaysSoFirst) {
  const AuditReport r = sound();
  EXPECT_TRUE(passes(r));
  EXPECT_EQ(audit_table(r).rfind("PASS", 0), 0U);
  const Json j = Json::parse(to_json(r));
  EXPECT_EQ(j.at("verdict"), "pass");
  EXPECT_EQ(to_json(r).rfind("{\"verdict\":\"pass\",\"requirements\":[{\"name\":", 0), 0U);
  for (const char* key : {"name", "limit", "value", "pass", "is_default"})
    EXPECT_TRUE(j["requirements"][0].contains(key));
  const std::string html = audit_html(r);
  EXPECT_LT(html.find("Verdict: PASS"), html.find("<table"));
}

TEST(Verdict, FailsByEachFigureByName) {
  struct Case {
    const char* name;
    void (*spoil)(AuditReport&);
  };
  const std::vector<Case> cases{
      {"missing", [](AuditReport& r) { r.missing = {"memory lock: no"}; }},
      {"stopped", [](AuditReport& r) { r.stopped_by = "track"; }},
      {"stopped", [](AuditReport& r) { r.interrupted = true; }},
      {"heap_calls", [](AuditReport& r) { r.heap_calls_after_start = 1; }},
      {"heap_calls", [](AuditReport& r) { r.heap_sealed = false; }},
      {"decisions_late", [](AuditReport& r) { r.decisions_too_late = 1; }},
      {"decision_stalls", [](AuditReport& r) { r.decision_stalls = 1; }},
      {"events_lost", [](AuditReport& r) { r.events_lost = 1; }},
      {"commands_lost", [](AuditReport& r) { r.commands.emplace().lost = 1; }},
      {"commands_late", [](AuditReport& r) { r.commands.emplace().late = 1; }},
      {"kill_faults", [](AuditReport& r) { r.kill_switch.emplace().faults = 1; }},
      {"flight.misses", [](AuditReport& r) { r.lanes[0].deadline_misses = 39; }},
      {"decision.slips", [](AuditReport& r) { r.lanes[1].slips = 83; }},
      {"watchdog.minor_faults", [](AuditReport& r) { r.lanes[3].minor_faults = 1; }},
      {"flight.major_faults", [](AuditReport& r) { r.lanes[0].major_faults = 1; }},
      {"flight.overruns", [](AuditReport& r) { r.slots[2].overruns = 1; }},
      {"flight.jitter_p999_us", [](AuditReport& r) { r.lanes[0].jitter.p999_us = 201.0; }},
      {"flight.jitter_p999_us", [](AuditReport& r) { r.lanes[0].jitter.p999_us.reset(); }},
      {"decision.misses", [](AuditReport& r) { r.lanes[1].frames = 0; }},
  };
  for (const Case& c : cases) {
    AuditReport r = sound();
    c.spoil(r);
    r.requirements = judge(r, requirements_of({}));
    EXPECT_FALSE(passes(r)) << c.name;
    EXPECT_FALSE(found(r, c.name).pass()) << c.name;
    EXPECT_EQ(audit_table(r).rfind("FAIL", 0), 0U);
    EXPECT_NE(audit_table(r).find(std::string("FAIL ") + c.name), std::string::npos) << audit_table(r);
    EXPECT_NE(audit_html(r).find("Verdict: FAIL"), std::string::npos);
    EXPECT_EQ(Json::parse(to_json(r)).at("verdict"), "fail");
  }
}

TEST(Verdict, WhatCannotBeKnownIsNotShownAndNoPass) {
  AuditReport r = sample();
  r.requirements = judge(r, requirements_of({}));
  const JudgedRequirement j = found(r, "flight.jitter_p999_us");
  EXPECT_FALSE(j.value);
  EXPECT_FALSE(j.pass());
  EXPECT_NE(audit_table(r).find("not shown (1000 frames are too few for it)"), std::string::npos)
      << audit_table(r);
  EXPECT_FALSE(passes(AuditReport{})) << "without requirements nothing is shown";
}

TEST(Verdict, RequirementsAreSetForOneLaneOrAllThatHaveOne) {
  AuditReport r = sound();
  r.lanes[0].deadline_misses = r.lanes[1].deadline_misses = 2;
  EXPECT_FALSE(found(r, "flight.misses").pass());
  EXPECT_TRUE(found(r, "flight.misses", {"misses=2"}).pass());
  EXPECT_TRUE(found(r, "decision.misses", {"misses=2"}).pass());
  EXPECT_TRUE(found(r, "flight.misses", {"flight.misses=2"}).pass());
  EXPECT_FALSE(found(r, "flight.misses", {"flight.misses=2"}).is_default);
  EXPECT_TRUE(found(r, "decision.misses", {"flight.misses=2"}).is_default);
  EXPECT_FALSE(found(r, "decision.misses", {"flight.misses=2"}).pass());
  EXPECT_FALSE(found(r, "background.response_max_us", {"background.response_max_us=1"}).pass());
  EXPECT_TRUE(found(r, "flight.jitter_max_us", {"jitter_max_us=9e9"}).pass())
      << "no default: the flight lane";
  // Taken back in words, and said so; infinity is no number to ask for.
  r.lanes[0].jitter.p999_us.reset();
  r.requirements = judge(r, requirements_of({"misses=2", "slips=2", "jitter_p999_us=none"}));
  EXPECT_TRUE(passes(r));
  EXPECT_NE(audit_table(r).find("by --require: flight.jitter_p999_us is not required"), std::string::npos);
  EXPECT_NE(audit_html(r).find("<td>not required</td><td>--require</td>"), std::string::npos);
  EXPECT_NE(Json::parse(to_json(r))["requirements"].dump().find("\"limit\":null"), std::string::npos);
}

TEST(Verdict, RefusesWhatIsNoRequirementAndListsWhatIs) {
  for (const char* bad :
       {"", "nope=1", "misses", "misses=", "misses=x", "misses=-1", "misses=nan", "misses=inf", "misses=1e",
        "nope.misses=1", "flight.nope=1", "flight.heap_calls=1", "heap_calls=1 2"})
    EXPECT_THROW((void)requirements_of({bad}), std::invalid_argument) << bad;
  try {
    (void)requirements_of({"nope=1"});
  } catch (const std::invalid_argument& error) {
    for (const char* name : {"'nope'", "heap_calls", "misses", "jitter_p999_us", "flight"})
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
  }
  for (const Requirement& q : requirements_of({}))
    EXPECT_NE(requirement_help().find(q.name.substr(q.name.find('.') + 1)), std::string::npos) << q.name;
}

TEST(InstructionCounts, AreReadOrRefused) {
  const InstructionCounts counts =
      instruction_counts(R"({"commit": "abc", "slots": {"map": {"runs": 16, "median": 5, "worst": 7}}})");
  EXPECT_EQ(counts.commit, "abc");
  EXPECT_EQ(counts.worst.at("map"), 7U);
  for (const std::string& bad :
       {std::string(), std::string("[]"), std::string(R"({"commit": "abc"})"),
        std::string(R"({"commit": 1, "slots": {}})"),
        std::string(R"({"commit": "abc", "slots": {"map": {"worst": "7"}}})"), std::string(1'000'000, '[')})
    EXPECT_THROW((void)instruction_counts(bad), std::invalid_argument) << bad.substr(0, 60);
  AuditReport r = sample();
  r.slots[0].instructions = 24'140;
  EXPECT_EQ(Json::parse(to_json(r))["slots"][0]["instructions"], 24'140);
  EXPECT_NE(audit_html(r).find("<td>24140</td>"), std::string::npos);
}

TEST(Sha256, GivesTheDigestsOfTheStandard) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  EXPECT_EQ(sha256_of_file("/nope"), "unknown");
}

Comparison compare_two(const AuditReport& before, const AuditReport& after, double tolerance_ratio) {
  return compare_audits(std::vector{to_json(before)}, std::vector{to_json(after)}, tolerance_ratio);
}

/// Runs of a program whose tracker takes `median_us`, each with its own luck.
std::vector<std::string> runs(std::size_t count, double median_us, std::uint64_t seed) {
  core::CounterRng rng(seed, 3);
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < count; ++i) {
    AuditReport r = sample();
    for (AuditSlot& s : r.slots) s.time.p99_us = s.time.max_us = median_us * rng.uniform(0.5, 2.0);
    texts.push_back(to_json(r));
  }
  return texts;
}

TEST(CompareAudits, RankTestGivesTheProbabilitiesOfTheTable) {
  const std::vector<double> low{1, 2, 3}, high{4, 5, 6};
  EXPECT_DOUBLE_EQ(rank_test(low, high), 1.0 / 20.0);
  EXPECT_DOUBLE_EQ(rank_test(high, low), 1.0);
  EXPECT_DOUBLE_EQ(rank_test(std::vector<double>{1, 2, 4}, std::vector<double>{3, 5, 6}), 2.0 / 20.0);
  EXPECT_DOUBLE_EQ(rank_test(std::vector<double>{7, 7, 7}, std::vector<double>{7, 7, 7}), 1.0);
  EXPECT_DOUBLE_EQ(rank_test(std::vector<double>{1, 2, 3, 4, 5}, std::vector<double>{6, 7, 8, 9, 10}),
                   1.0 / 252.0);
  EXPECT_DOUBLE_EQ(rank_test({}, high), 1.0);
}

TEST(CompareAudits, RunsOfTheSameProgramAreSeldomARegressionAndASlowerOneIs) {
  int alarms = 0, rows = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Comparison c = compare_audits(runs(3, 100.0, seed), runs(3, 100.0, seed + 1000), 1.0);
    alarms += static_cast<int>(c.worse.size());
    rows += 2 * static_cast<int>(core::kSlotCount);
  }
  EXPECT_LE(alarms, rows * 8 / 100) << "5 % by chance, with a tolerance of nothing";
  EXPECT_GT(alarms, 0) << "it never alarms: nothing was tested";
  EXPECT_EQ(compare_audits(runs(3, 100.0, 1), runs(3, 1000.0, 2), 1.5).worse.size(), 2 * core::kSlotCount);
}

TEST(CompareAudits, KnowsTheNoiseOfThreeRunsASideAndSaysWhereItDoesNot) {
  const auto notes = [](const Comparison& c) {
    std::string all;
    for (const std::string& note : c.notes) all += note + "\n";
    return all;
  };
  EXPECT_NE(notes(compare_audits(runs(1, 1, 1), runs(1, 1, 1), 1.5)).find("noise is not known"),
            std::string::npos);
  EXPECT_NE(notes(compare_audits(runs(2, 1, 1), runs(9, 1, 1), 1.5)).find("noise is not known"),
            std::string::npos);
  EXPECT_NE(notes(compare_audits(runs(3, 1, 1), runs(3, 1, 1), 1.5)).find("medians of 3 and 3 runs"),
            std::string::npos);
}

TEST(CompareAudits, OneHeapCallInOneRunIsARegressionWhateverTheNoise) {
  std::vector<std::string> after = runs(3, 100.0, 1);
  AuditReport r = sample();
  r.heap_calls_after_start = 1;
  for (AuditSlot& s : r.slots) s.time.p99_us = s.time.max_us = 100.0;
  after[1] = to_json(r);
  const Comparison c = compare_audits(runs(3, 100.0, 1), after, 2.0);
  ASSERT_EQ(c.worse.size(), 1U) << c.table;
  EXPECT_EQ(c.worse[0].rfind("heap calls", 0), 0U);
}

TEST(CompareAudits, RefusesOtherFlightsAndMixedSidesAndNamesTheDifference) {
  for (const char* key : {"rate_Hz", "asked_seconds", "interrupted", "environment", "seed", "profile",
                          "profile_digest", "vehicle", "vehicle_digest", "settings", "settings_digest",
                          "load", "bus", "kill_lines", "injected", "real_time"}) {
    AuditReport other = sample();
    std::erase_if(other.identity, [key](const auto& pair) { return pair.first == key; });
    other.identity.emplace_back(key, "other");
    const Comparison c = compare_two(sample(), other, 1.5);
    ASSERT_EQ(c.not_comparable.size(), 1U) << key;
    EXPECT_EQ(c.not_comparable[0].rfind(key, 0), 0U);
    EXPECT_EQ(c.table, "");
  }
  AuditReport other = sample();
  other.identity.back().second = "sha256 2";
  EXPECT_TRUE(compare_two(sample(), other, 1.5).not_comparable.empty())
      << "another program is what is compared";
  const std::vector<std::string> mixed{to_json(sample()), to_json(other)};
  EXPECT_EQ(compare_audits(std::vector{to_json(sample())}, mixed, 1.5).not_comparable.size(), 1U);
}

TEST(CompareAudits, FindsWhatBecameWorseAndOnlyThat) {
  const AuditReport before = sample();
  EXPECT_TRUE(compare_two(before, before, 1.5).worse.empty());
  AuditReport after = sample();
  after.slots[3].time.p99_us = *after.slots[3].time.p99_us * 2.0;
  after.heap_calls_after_start = 1;
  after.lanes[0].deadline_misses = 5;
  after.identity[0].second = "6.2";
  const Comparison c = compare_two(before, after, 1.5);
  ASSERT_EQ(c.worse.size(), 3U) << c.table;
  EXPECT_NE(c.table.find("WORSE"), std::string::npos);
  EXPECT_EQ(std::count_if(c.notes.begin(), c.notes.end(),
                          [](const std::string& note) { return note.rfind("kernel differs", 0) == 0; }),
            1);
  EXPECT_TRUE(compare_two(after, before, 1.5).worse.empty()) << "better is not worse";
  EXPECT_EQ(compare_two(before, after, 2.5).worse.size(), 2U);
}

TEST(CompareAudits, RefusesWhatIsNoAudit) {
  const std::vector<std::string> good{to_json(sample())};
  for (const std::string& bad :
       {std::string(), std::string("{"), std::string("[]"), std::string("{\"slots\":1}"),
        std::string("{\"slots\":[{}],\"lanes\":[{}]}"),
        std::string("{\"verdict\":\"pass\",\"slots\":[{}],\"lanes\":[{}]}"),
        std::string(1'000'000, '[') + std::string(1'000'000, ']'),
        "{\"slots\":" + std::string(100'000, '[') + std::string(100'000, ']') + ",\"lanes\":1}"})
    EXPECT_THROW((void)compare_audits(std::vector{bad}, good, 1.5), std::invalid_argument)
        << bad.substr(0, 60);
}

}  // namespace
}  // namespace roborun::report
