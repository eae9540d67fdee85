#include "platform/log/flight_log.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "platform/input/json_reader.hpp"
#include "platform/log/log_thread.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/log/word_coding.hpp"
#include "tests/platform/log/sample_log.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::log {
namespace {

using Json = nlohmann::ordered_json;

/// The last message of each topic, and how many there are.
struct Topics {
  std::map<std::string, Json> last;
  std::map<std::string, int> count;
};
Topics topics_of(const std::string& path) {
  Topics topics;
  McapReader reader(path);
  for (Message message; reader.next(message);) {
    const std::string& topic = message.channel->topic;
    ++topics.count[topic];
    if (message.channel->message_encoding == "json") topics.last[topic] = input::parse_json(message.data);
  }
  EXPECT_EQ(reader.damage(), "");
  return topics;
}

struct Coded {
  std::string runs, bits;
};

TEST(WordCoding, GivesBackAnyBits) {
  std::string words;
  const auto add = [&words](std::uint32_t word) { Put(words).number(word); };
  const std::uint32_t nothing = 0x7F800000U;
  for (const std::uint32_t word :
       {0U, nothing, 1U, 0x80000001U, nothing, 0xFFFFFFFFU, 0x7FFFFFFFU, 0xFF800000U, 0U, 0x80000000U, 0U,
        nothing, nothing, 0x7FC00000U, 0xFFC00000U, 0x00000000U})
    add(word);
  words += test::noise(3, 4 * 2000);
  for (std::uint32_t i = 0; i < 2000; ++i) add(i % 3 == 0 ? nothing : 0x41200000U + i);
  for (const WordLayout layout :
       {WordLayout{4, 1}, {4, 3}, {4, 6}, {8, 1}, {8, 5}, {2, 4}, {4, 1, 64}, {4, 1, 1}, {4, 1, 9999}}) {
    Coded coded;
    append_coded_words(coded.runs, coded.bits, words, layout);
    append_coded_words(coded.runs, coded.bits, "", {4, 1});
    append_coded_words(coded.runs, coded.bits, words.substr(0, 12), {4, 1});
    std::string_view runs = coded.runs;
    std::string_view bits = coded.bits;
    std::string decoded;
    append_decoded_words(decoded, words.size() / layout.bytes, layout, runs, bits);
    EXPECT_EQ(decoded, words) << layout.bytes << ", " << layout.stride << ", " << layout.row;
    append_decoded_words(decoded, 0, {4, 1}, runs, bits);
    append_decoded_words(decoded, 3, {4, 1}, runs, bits);
    EXPECT_EQ(decoded, words + words.substr(0, 12));
    EXPECT_TRUE(runs.empty() && bits.empty());
  }
}

TEST(WordCoding, DepthsInMillimetresAreCountsAndComeBackAsTheyWere) {
  std::string words, nearly;
  const std::string noise = test::noise(5, 3000);
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const auto count = static_cast<float>(4000 + static_cast<std::uint8_t>(noise[i]));
    const float depth_m = i % 7 == 0 ? std::numeric_limits<float>::infinity() : count * 0.001F;
    Put(words).number(std::bit_cast<std::uint32_t>(depth_m));
    Put(nearly).number(std::bit_cast<std::uint32_t>(depth_m) + (i == 2999 ? 1U : 0U));
  }
  const auto coded_bytes = [](const std::string& text) {
    Coded coded;
    append_coded_words(coded.runs, coded.bits, text, {4, 1});
    std::string_view runs = coded.runs;
    std::string_view bits = coded.bits;
    std::string decoded;
    append_decoded_words(decoded, text.size() / 4, {4, 1}, runs, bits);
    EXPECT_EQ(decoded, text);
    EXPECT_TRUE(runs.empty() && bits.empty());
    return coded.bits.size();
  };
  EXPECT_LT(2 * coded_bytes(words), coded_bytes(nearly)) << "one of them is a bit off: all are coded as bits";
  std::string all;  // each that there is, and the first that is none
  for (std::uint32_t count = 0; count <= 70'000; ++count)
    Put(all).number(std::bit_cast<std::uint32_t>(static_cast<float>(count) * 0.001F));
  (void)coded_bytes(all);
}

TEST(WordCoding, AnImageTakesFewerBitsThanItsPixelsInARow) {
  constexpr std::size_t kWidth = 64, kHeight = 48;
  std::string words;
  const std::string noise = test::noise(5, kWidth * kHeight);
  for (std::size_t i = 0; i < kWidth * kHeight; ++i) {
    const auto count =
        static_cast<float>(4000 + 100 * (i % kWidth) + static_cast<std::uint8_t>(noise[i]) / 8);
    Put(words).number(std::bit_cast<std::uint32_t>(count * 0.001F));
  }
  Coded image, row;
  append_coded_words(image.runs, image.bits, words, {4, 1, kWidth});
  append_coded_words(row.runs, row.bits, words, {4, 1});
  EXPECT_LT(image.bits.size(), row.bits.size());
}

TEST(WordCoding, RefusesTextsThatEndEarlyAndRunsThatAreNone) {
  const std::string words = test::noise(3, 4 * 20);
  Coded coded;
  append_coded_words(coded.runs, coded.bits, words, {4, 1});
  const auto decode = [](std::string_view runs, std::string_view bits) {
    std::string to;
    append_decoded_words(to, 20, {4, 1}, runs, bits);
  };
  decode(coded.runs, coded.bits);
  EXPECT_EQ(coded.runs, std::string({0, 0, 20})) << "a form, then what the run is of and its length";
  EXPECT_THROW(decode(coded.runs, std::string_view(coded.bits).substr(0, coded.bits.size() - 1)), InputError);
  for (const std::string& runs :
       {std::string(), std::string({0}), std::string({0, 0}), std::string({2, 0, 20}),
        std::string({0, 3, 20}), std::string({0, 0, 21}), std::string({0, 0, 19}), std::string({0, 0, 0}),
        std::string({0, 0, -1}), std::string({0, 0, -1, -1, -1, -1, -1, 1})})
    EXPECT_THROW(decode(runs, coded.bits), InputError);
}

TEST(FlightLog, HoldsTheTopicsOfItsReadme) {
  const std::string path = roborun::test::scratch("topics.mcap");
  {
    FlightLog log(path, false);
    log.configure(R"({"replay":"a test"})", {{"commit", "0"}});
    log.world(R"({"height_m":2})");
    StateRecord state;
    state.phase = "mission";
    state.has_motors = true;
    state.battery_ratio = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < 400; ++i) {
      state.time_ns = i * 25'000'000LL;
      state.p_WB = {0.1 * i, 0, 2};
      log.write(state);
    }
    DecisionEntry decision;
    decision.solver = "ok";
    decision.ways = "no path";
    decision.active.add("d_obs");
    decision.points = 2;
    decision.closest_obstacle_m = std::numeric_limits<double>::infinity();
    log.write(decision);
    FailsafeEntry failsafe;
    failsafe.action = "land";
    failsafe.conditions.add("gnss");
    failsafe.conditions.add("imu");
    log.write(failsafe);
    const auto slice = std::make_unique<MapSlice>();
    slice->columns = 2;
    slice->rows = 1;
    slice->cell[1] = MapSlice::kOccupied;
    log.write(*slice);
    log.result(0, R"({"reason":"test"})");
    log.inputs(0, "bytes");
  }
  Topics topics = topics_of(path);
  EXPECT_EQ(topics.count["/state"], 400);
  EXPECT_EQ(topics.count["/pose"], 100);
  EXPECT_EQ(topics.count["/tf"], 100);
  EXPECT_EQ(topics.count["/path"], 5);
  EXPECT_EQ(topics.count["/inputs"], 1);
  EXPECT_DOUBLE_EQ(topics.last["/state"]["x_m"].get<double>(), 39.9);
  EXPECT_TRUE(topics.last["/state"]["battery_ratio"].is_null());
  EXPECT_FALSE(topics.last["/state"].contains("true_x_m"));
  EXPECT_EQ(topics.last["/tf"]["transforms"][0]["child_frame_id"], "body");
  EXPECT_EQ(topics.last["/pose"]["timestamp"]["sec"], 9);
  EXPECT_EQ(topics.last["/trajectory"]["poses"].size(), 2U);
  EXPECT_TRUE(topics.last["/decision"]["closest_obstacle_m"].is_null());
  const Json& why = topics.last["/decision"]["why"];
  EXPECT_NE(why.dump().find("none of it leads to the goal"), std::string::npos);
  EXPECT_NE(why.dump().find("but for the nearest obstacle"), std::string::npos);
  EXPECT_EQ(topics.last["/failsafe"]["conditions"], (Json{"gnss", "imu"}));
  EXPECT_EQ(topics.last["/events"]["message"], "land (gnss+imu)");
  EXPECT_EQ(topics.last["/map"]["data"], "AGQ=");
  EXPECT_EQ(topics.count.count("/log/dropped"), 0U);
}

TEST(FlightLog, AFlownPathStaysBounded) {
  const std::string path = roborun::test::scratch("path.mcap");
  {
    FlightLog log(path, false);
    StateRecord state;
    for (int i = 0; i < 40 * 600; ++i) {
      state.time_ns = i * 25'000'000LL;
      state.p_WB = {0.01 * i, 0, 0};
      log.write(state);
    }
  }
  const Json poses = topics_of(path).last["/path"]["poses"];
  EXPECT_LE(poses.size(), 129U);
  EXPECT_GE(poses.size(), 60U);
  EXPECT_GT(poses.back()["position"]["x"].get<double>(), 220.0) << "its end is missing";
  EXPECT_EQ(poses.front()["position"]["x"].get<double>(), 0.0);
}

TEST(LogThread, WritesWhatLanesPutIntoItsRings) {
  const std::string path = roborun::test::scratch("thread.mcap");
  FlightLog log(path, true);
  LogThread thread(log);
  StateRecord state;
  std::uint64_t pushed = 0;
  for (; pushed < 200; ++pushed) {
    state.time_ns = static_cast<std::int64_t>(pushed) * 25'000'000;
    thread.write(state);
  }
  thread.write(DecisionEntry{});
  thread.stop();
  thread.stop();
  log.finish();
  Topics topics = topics_of(path);
  EXPECT_EQ(thread.drops(), RingDrops{});
  EXPECT_EQ(topics.count["/state"], 200);
  EXPECT_EQ(topics.count["/decision"], 1);
}

TEST(LogThread, AFullRingDropsAndTheLogSaysHowMuch) {
  const std::string path = roborun::test::scratch("full.mcap");
  FlightLog log(path, false);
  LogThread thread(log);
  // Quicker than anybody can write: most of it finds a full ring.
  StateRecord state;
  std::uint64_t pushed = 0;
  for (; pushed < 10'000'000 && thread.drops().states < 1000; ++pushed) thread.write(state);
  ASSERT_GE(thread.drops().states, 1000U) << "nothing was dropped: nothing was tested";
  thread.stop();
  log.finish();
  Topics topics = topics_of(path);
  EXPECT_EQ(topics.last["/log/dropped"]["states"], thread.drops().states);
  EXPECT_EQ(static_cast<std::uint64_t>(topics.count["/state"]) + thread.drops().states, pushed);
}

}  // namespace
}  // namespace roborun::log
