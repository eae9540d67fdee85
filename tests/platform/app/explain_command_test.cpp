#include "platform/app/explain_command.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/report/trace_csv.hpp"
#include "tests/platform/report/sample.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::app {
namespace {

std::string trace() {
  std::vector<report::MissionReport> missions{test::sample_mission("aware", 4.0),
                                              test::sample_mission("static", 0.5)};
  for (report::MissionReport& m : missions) {
    for (report::DecisionRecord& d : m.decisions) {
      d.deadline_s = 1.0;
      d.active = "deadline+d_obs";
      d.solver = "ok";
      d.predicted_s[2] = 0.125;
    }
  }
  missions[0].decisions[7].missed = true;
  missions[1].decisions[3].ways_status = "no path";
  missions[1].decisions[4].ways_status = "not ready";
  missions[0].decisions[7].refused = "camera 1 fog+camera 2 turned";
  const std::string path = test::scratch("explain.csv");
  input::write_file(path, report::trace_csv(missions));
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Explain, NamesTheDecisionInForceAndEverythingThatSetIt) {
  const std::string text = explain_decision("t.csv", trace(), 7.9, "");
  EXPECT_NE(text.find("Decision 8 of aware, at 7.00 s"), std::string::npos) << text;
  EXPECT_NE(text.find("the trajectory being flown"), std::string::npos);
  EXPECT_NE(text.find("Set by the vehicle file: its fastest flight."), std::string::npos) << text;
  EXPECT_NE(text.find("0.1250"), std::string::npos) << "predicted time of the map";
  EXPECT_NE(text.find("all the time is used"), std::string::npos);
  EXPECT_NE(text.find("nearest obstacle"), std::string::npos);
  EXPECT_NE(text.find("Not believed  camera 1 fog, camera 2 turned."), std::string::npos) << text;
  EXPECT_EQ(explain_decision("t.csv", trace(), 3.0, "").find("Not believed"), std::string::npos);
  EXPECT_NE(text.find("LATE"), std::string::npos);
  EXPECT_NE(text.find("Which way     585.0 m to the goal"), std::string::npos) << text;
  EXPECT_NE(explain_decision("t.csv", trace(), 3.0, "static").find("Decision 4 of static"),
            std::string::npos);
}

TEST(Explain, SaysWhatTheWaysSaid) {
  const auto way = [](double at_s) { return explain_decision("t.csv", trace(), at_s, "static"); };
  EXPECT_NE(way(3.0).find("none of it leads to the goal"), std::string::npos);
  EXPECT_NE(way(4.0).find("nothing remembers ways"), std::string::npos);
}

TEST(Explain, RefusesATimeOutsideAnUnknownDesignAndAnotherFile) {
  const auto complaint = [](const std::string& csv, double at_s, const std::string& design) -> std::string {
    try {
      return explain_decision("t.csv", csv, at_s, design);
    } catch (const InputError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(complaint(trace(), 99.0, ""), "--at: 99 s is outside the trace: must be 0.00 to 20.00");
  EXPECT_EQ(complaint(trace(), -1.0, ""), "--at: -1 s is outside the trace: must be 0.00 to 20.00");
  EXPECT_EQ(complaint(trace(), 1.0, "fast"),
            "t.csv: no decision of design 'fast': must be one of aware, static");
  EXPECT_NE(complaint("a,b\n1,2\n", 1.0, "").find("no column 'design'"), std::string::npos);
  EXPECT_NE(complaint("", 1.0, "").find("no column"), std::string::npos);
  std::string cut = trace();
  cut.resize(cut.size() - 40);
  EXPECT_NE(complaint(cut, 1.0, "static").find("fields: must be"), std::string::npos);
}

}  // namespace
}  // namespace roborun::app
