#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "platform/evaluation/sweep_run.hpp"
#include "platform/evaluation/worker_processes.hpp"
#include "platform/input/input_error.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::evaluation {
namespace {

/// Two short environments, two designs, two seeds, each stopped after seconds of flight.
SweepPlan small_plan() {
  SweepPlan plan;
  plan.commit = "c0ffee";
  plan.build = "0123456789abcdef";
  plan.environments = {"1", "14"};
  plan.profiles = {{"paper", "0"}};
  plan.designs = {"aware", "static"};
  plan.seeds = {1, 2};
  return plan;
}

SweepInputs small_inputs() {
  SweepInputs inputs;
  inputs.profile["paper"] = board::paper();
  inputs.base[""].judge.time_limit_s = 8.0;
  return inputs;
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files[entry.path().filename().string()] = read(entry.path().string());
  return files;
}

std::string sweep_into(const std::string& name, const SweepPlan& plan, int jobs) {
  const std::string folder = test::scratch(name);
  SweepStore store(folder, plan);
  EXPECT_TRUE(fly_sweep(store, small_inputs(), jobs));
  EXPECT_TRUE(store.complete());
  if (plan.shards == 1) write_sweep_report(store);
  return folder;
}

TEST(Sweep, HasTheSameBytesWithOneJobWithTwoAndFromShards) {
  const auto one = files_of(sweep_into("one", small_plan(), 1));
  ASSERT_EQ(std::count(one.at("results.jsonl").begin(), one.at("results.jsonl").end(), '\n'), 8);
  EXPECT_EQ(one.count("flight_aware_1.json"), 1U);
  EXPECT_EQ(one.count("flight_aware_2.json"), 1U) << "every seed of the representative environment";
  EXPECT_NE(one.at("tables.txt").find("zone"), std::string::npos);
  for (const char* file : {"request.json", "tables.txt", "report.html"})
    EXPECT_NE(one.at(file).find("c0ffee"), std::string::npos) << file << " names no commit";
  const std::string& page = one.at("report.html");
  EXPECT_NE(page.find("</svg>"), std::string::npos);
  for (const char* outside : {"href", "<script", "src="}) EXPECT_EQ(page.find(outside), std::string::npos);
  EXPECT_EQ(files_of(sweep_into("two", small_plan(), 2)), one);

  std::vector<std::string> shards;
  for (int shard = 3; shard >= 1; --shard) {
    SweepPlan part = small_plan();
    part.shard = shard;
    part.shards = 3;
    shards.push_back(sweep_into("shard" + std::to_string(shard), part, 2));
  }
  const std::string whole = test::scratch("merged");
  merge_shards(shards, whole);
  const SweepStore store(whole, small_plan());
  EXPECT_TRUE(store.complete());
  write_sweep_report(store);
  EXPECT_EQ(files_of(whole), one);
}

TEST(Sweep, GoesOnWhereItWasCutOffAtAnyByte) {
  SweepPlan plan = small_plan();
  plan.environments = {"1"};
  const std::string folder = sweep_into("cut", plan, 2);
  const std::string results = folder + "/results.jsonl";
  const auto whole = files_of(folder);
  const std::string lines = whole.at("results.jsonl");
  const std::size_t second = lines.find('\n', lines.find('\n') + 1) + 1;
  for (const std::size_t cut : {std::size_t{0}, second - 1, second, second + 1, lines.size() - 1}) {
    std::ofstream(results, std::ios::binary | std::ios::trunc) << lines.substr(0, cut);
    SweepStore store(folder, plan);
    EXPECT_FALSE(store.complete()) << cut;
    EXPECT_EQ(store.results().size(),
              static_cast<std::size_t>(
                  std::count(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(cut), '\n')));
    EXPECT_TRUE(fly_sweep(store, small_inputs(), 2));
    write_sweep_report(store);
    EXPECT_EQ(files_of(folder), whole) << cut;
  }
}

TEST(Sweep, FliesNothingTwice) {
  SweepPlan plan = small_plan();
  plan.environments = {"1"};
  const std::string folder = sweep_into("again", plan, 2);
  SweepInputs none;  // without a profile no mission could fly
  SweepStore store(folder, plan);
  EXPECT_TRUE(fly_sweep(store, none, 2));
}

TEST(Sweep, ShardsPartTheMissionsEvenlyInEveryDesign) {
  SweepPlan plan = small_plan();
  plan.designs = {"aware", "static", "static-fair"};
  plan.seeds = {1, 2, 3};
  const std::size_t all = missions_of(plan).size();
  ASSERT_EQ(all, 18U);
  plan.shards = 3;
  std::map<std::string, int> seen;
  for (plan.shard = 1; plan.shard <= plan.shards; ++plan.shard) {
    std::map<std::string, int> designs;
    for (const SweepMission& mission : missions_of(plan)) {
      ++seen[name_of(mission)];
      ++designs[mission.design];
    }
    EXPECT_EQ(designs.size(), 3U) << "shard " << plan.shard;
  }
  EXPECT_EQ(seen.size(), all);
}

TEST(SweepPlan, ReadsBackWhatItWroteAndNamesTheFirstDifference) {
  SweepPlan plan = small_plan();
  const SweepPlan back = plan_from_json("x", to_json(plan));
  EXPECT_EQ(difference(back, plan), "");
  plan.settings = "f";
  EXPECT_EQ(difference(back, plan), "settings");
  plan.seeds = {3};
  EXPECT_EQ(difference(back, plan), "seeds");
  const std::string text = to_json(plan);
  std::string before_commits = text;
  const std::size_t at = before_commits.find("\"commit\"");
  before_commits.erase(at, before_commits.find('\n', at) - at);
  EXPECT_EQ(plan_from_json("x", before_commits).commit, "") << "folders of before can still be read";
  for (std::size_t cut = 0; cut + 2 < text.size(); cut += 7)
    EXPECT_THROW((void)plan_from_json("x", text.substr(0, cut)), InputError);
}

template <typename F>
std::string refusal(F&& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SweepStore, RefusesAnotherPlanASecondProcessAndForeignLinesInOneLine) {
  const std::string folder = test::scratch("refuses");
  const auto open = [&](const SweepPlan& plan) {
    return refusal([&] { const SweepStore store(folder, plan); });
  };
  SweepPlan plan = small_plan();
  {
    const SweepStore store(folder, plan);
    EXPECT_NE(open(plan).find("another process"), std::string::npos);
  }
  EXPECT_EQ(open(plan), "accepted");
  plan.commit = "0f1e2d";
  EXPECT_NE(open(plan).find("other commit (c0ffee; this program is of 0f1e2d)"), std::string::npos)
      << open(plan);
  plan = small_plan();
  plan.build = "other";
  EXPECT_NE(open(plan).find("other build"), std::string::npos) << open(plan);
  plan = small_plan();
  plan.shard = plan.shards = 2;
  EXPECT_NE(open(plan).find("other shard"), std::string::npos);
  std::ofstream(folder + "/results.jsonl") << "{\"design\":\"aware\"}\n";
  EXPECT_NE(open(small_plan()).find("results.jsonl:1:"), std::string::npos) << open(small_plan());
  EXPECT_NE(refusal([&] {
              merge_shards({test::scratch("nothing")}, test::scratch("merged2"));
            }).find("cannot be opened"),
            std::string::npos);
}

TEST(SweepStore, RefusesToMergeShardsOfDifferentSweeps) {
  SweepPlan a = small_plan();
  a.shards = 2;
  SweepPlan b = a;
  b.shard = 2;
  b.seeds = {1};
  { const SweepStore first(test::scratch("a"), a), second(test::scratch("b"), b); }
  const std::string what = refusal([&] {
    merge_shards({test::scratch("a"), test::scratch("b")}, test::scratch("ab"));
  });
  EXPECT_NE(what.find("seeds"), std::string::npos) << what;
}

TEST(WorkerProcesses, GiveEveryAnswerOnceTellDeathsAndRefuseInTheParent) {
  const std::vector<std::size_t> tasks{0, 1, 2, 3, 4};
  std::map<std::size_t, std::string> answers;
  std::vector<std::size_t> dead;
  int left_behind = 0;
  const auto work = [&left_behind](std::size_t i) -> std::string {
    if (i == 3) (void)raise(SIGKILL);
    return std::string(100'000 * i, 'x') + std::to_string(++left_behind);
  };
  EXPECT_TRUE(run_in_processes(tasks, 2,
                               {work,
                                [&](std::size_t i, const std::string& s) { answers[i] = s; },
                                [&](std::size_t i) { dead.push_back(i); },
                                {}}));
  EXPECT_EQ(dead, std::vector<std::size_t>{3});
  ASSERT_EQ(answers.size(), 4U);
  for (const auto& [i, s] : answers)
    EXPECT_EQ(s, std::string(100'000 * i, 'x') + "1") << "memory is not shared";
  const auto refuse = [](std::size_t) -> std::string { throw InputError("no"); };
  EXPECT_EQ(refusal([&] {
              (void)run_in_processes(
                  tasks, 2, {refuse, [](std::size_t, const std::string&) {}, [](std::size_t) {}, {}});
            }),
            "no");
}

TEST(WorkerProcesses, LeaveNoProcessBehindWhenTheyAreStopped) {
  const std::vector<std::size_t> tasks{0, 1, 2, 3};
  const auto sleep_long = [](std::size_t) -> std::string {
    (void)sleep(600);
    return "late";
  };
  int ticks = 0;
  EXPECT_FALSE(run_in_processes(tasks, 2,
                                {sleep_long, [](std::size_t, const std::string&) { FAIL(); },
                                 [](std::size_t) { FAIL(); }, [&ticks] { return ++ticks < 2; }}));
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "no child left";
}

}  // namespace
}  // namespace roborun::evaluation
