#include "platform/report/audit_report.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/executive/frame_table.hpp"
#include "core/random/counter_rng.hpp"

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
  r.identity = {{"kernel", "6.1"}, {"cpu", "a <fast> one"}};
  r.trace = {{1, 5, 10.0, 2.5, false}, {8, 6, 20.0, 3.5, true}};
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
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("<few>"), std::string::npos);
  EXPECT_NE(html.find("&lt;few&gt; &amp; far"), std::string::npos);
  std::size_t plots = 0;
  for (std::size_t at = html.find("<svg"); at != std::string::npos; at = html.find("<svg", at + 1)) ++plots;
  EXPECT_EQ(plots, core::kLaneCount + core::kSlotCount);
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

TEST(AuditReport, TraceIsJsonWithOneEventASlot) {
  const Json j = Json::parse(perfetto_trace(sample()));
  std::vector<std::string> names;
  for (const Json& e : j.at("traceEvents")) {
    if (e.at("ph") == "X") names.push_back(e.at("name"));
  }
  EXPECT_EQ(names, (std::vector<std::string>{"sense", "map"}));
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

TEST(CompareAudits, FindsWhatBecameWorseAndOnlyThat) {
  const AuditReport before = sample();
  EXPECT_TRUE(compare_audits(to_json(before), to_json(before), 1.5).worse.empty());
  AuditReport after = sample();
  after.slots[3].time.p99_us *= 2.0;
  after.heap_calls_after_start = 1;
  after.lanes[0].deadline_misses = 5;
  after.identity[0].second = "6.2";
  const Comparison c = compare_audits(to_json(before), to_json(after), 1.5);
  ASSERT_EQ(c.worse.size(), 3U) << c.table;
  EXPECT_NE(c.table.find("WORSE"), std::string::npos);
  EXPECT_EQ(c.notes.size(), 1U);
  EXPECT_TRUE(compare_audits(to_json(after), to_json(before), 1.5).worse.empty()) << "better is not worse";
  EXPECT_EQ(compare_audits(to_json(before), to_json(after), 2.5).worse.size(), 2U);
}

TEST(CompareAudits, RefusesWhatIsNoAudit) {
  const std::string good = to_json(sample());
  for (const std::string& bad :
       {std::string(), std::string("{"), std::string("[]"), std::string("{\"slots\":1}"),
        std::string("{\"slots\":[{}],\"lanes\":[{}]}")})
    EXPECT_THROW((void)compare_audits(bad, good, 1.5), std::invalid_argument) << bad;
}

}  // namespace
}  // namespace roborun::report
