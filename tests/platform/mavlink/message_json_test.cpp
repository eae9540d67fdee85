#include "platform/mavlink/message_json.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "firmware_if/mavlink/flight_messages.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::mavlink {
namespace {

namespace mav = firmware_if::mavlink;
using Json = nlohmann::ordered_json;

Json decoded(const std::vector<std::uint8_t>& bytes) {
  mav::Frame frame;
  EXPECT_EQ(mav::read_frame(bytes, frame), mav::FrameState::kComplete);
  return to_json(frame);
}

std::vector<std::uint8_t> encoded(const std::string& text, const mav::SigningKey* key = nullptr) {
  return from_json(Json::parse(text), 7, key);
}

std::string complaint(const std::string& text) {
  try {
    (void)encoded(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing";
}

TEST(MavlinkJson, SaysWhatIsNotGiven) {
  EXPECT_EQ(decoded(encoded(R"({"name":"SYSTEM_TIME"})")).dump(),
            R"({"msgid":2,"name":"SYSTEM_TIME","version":2,"seq":7,"sysid":1,"compid":191,"signed":false,)"
            R"("fields":{"time_unix_usec":0,"time_boot_ms":0}})");
}

TEST(MavlinkJson, KeepsEveryNumberExactly) {
  const std::string text =
      R"j({"msgid":331,"fields":{"time_usec":18446744073709551615,"x":0.1,"y":-0.0,"z":1e-45,)j"
      R"j("vx":3.4028235e+38,"vy":"NaN","vz":"NaN(0xffc00001)","rollspeed":"-Infinity","quality":-128}})j";
  const std::vector<std::uint8_t> bytes = encoded(text);
  const Json fields = decoded(bytes).at("fields");
  EXPECT_EQ(fields.at("time_usec"), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(fields.at("x").dump(), "0.1");
  EXPECT_EQ(fields.at("y").dump(), "-0.0");
  EXPECT_EQ(fields.at("z").dump(), "1e-45");
  EXPECT_EQ(fields.at("vx").dump(), "3.4028235e+38");
  EXPECT_EQ(fields.at("vy"), "NaN");
  EXPECT_EQ(fields.at("vz"), "NaN(0xffc00001)");
  EXPECT_EQ(fields.at("rollspeed"), "-Infinity");
  EXPECT_EQ(fields.at("quality"), -128);
  EXPECT_EQ(from_json(decoded(bytes), 0, nullptr), bytes);
}

TEST(MavlinkJson, KeepsTextOfAnyBytes) {
  const std::vector<std::uint8_t> bytes =
      encoded(R"({"name":"STATUSTEXT","fields":{"text":"Pr\u00e9Arm:\u0000\u00ff"}})");
  EXPECT_EQ(decoded(bytes).at("fields").at("text").get<std::string>(),
            std::string("Pr\u00e9Arm:\0\u00ff", 11));
  EXPECT_EQ(from_json(decoded(bytes), 0, nullptr), bytes);
}

TEST(MavlinkJson, LeavesExtensionsOutOfVersion1) {
  const Json v1 = decoded(encoded(R"({"name":"COMMAND_ACK","version":1,"fields":{"command":400}})"));
  EXPECT_EQ(v1.at("version"), 1);
  EXPECT_EQ(v1.at("fields").dump(), R"({"command":400,"result":0})");
}

TEST(MavlinkJson, SignsWithTheKeyOrTakesTheHashThatStandsThere) {
  const mav::SigningKey key{1, 2, 3};
  const std::string text =
      R"({"name":"HEARTBEAT","signed":true,"signature":{"link_id":3,"timestamp":281474976710655)";
  const std::vector<std::uint8_t> bytes = encoded(text + "}}", &key);
  std::array<mav::Verifier::Stream, 1> streams{};
  mav::Verifier verifier(key, streams, 0);
  const auto view = std::span<const std::uint8_t>(bytes);
  EXPECT_EQ(verifier.check(1, 191, view.first(bytes.size() - 13), view.last<13>()),
            mav::SignatureVerdict::kGood);
  EXPECT_EQ(from_json(decoded(bytes), 0, nullptr), bytes);
  EXPECT_EQ(decoded(encoded(text + R"(,"hash":"0123456789ab"}})")).at("signature").at("hash"),
            "0123456789ab");
}

TEST(MavlinkJson, NamesWhatIsWrong) {
  EXPECT_EQ(complaint("[]"), "must be an object with name or msgid, and fields");
  EXPECT_EQ(complaint(R"({"fields":{}})"),
            R"(must have a name or a msgid: {"name":"HEARTBEAT","fields":{..}})");
  EXPECT_EQ(complaint(R"({"name":"NOPE"})"), R"(name: "NOPE" is not a message that roborun knows)");
  EXPECT_EQ(complaint(R"({"msgid":9999})"), "msgid: 9999 is not a message that roborun knows");
  EXPECT_EQ(complaint(R"({"msgid":0,"name":"PING"})"), "name: msgid 0 is HEARTBEAT");
  EXPECT_EQ(complaint(R"({"msgid":0,"sysID":1})"),
            "'sysID' is unknown: must be one of time_us, msgid, name, version, seq, sysid, compid, signed, "
            "signature, fields");
  EXPECT_EQ(complaint(R"({"msgid":0,"sysid":256})"), "sysid: 256 is not a whole number from 0 to 255");
  EXPECT_EQ(complaint(R"({"msgid":0,"version":0})"), "version: 0 is not 1 or 2");
  EXPECT_EQ(complaint(R"({"msgid":330,"version":1})"), "version: OBSTACLE_DISTANCE has no MAVLink 1 frame");
  EXPECT_EQ(complaint(R"({"msgid":0,"fields":{"nope":1}})"), "fields: HEARTBEAT has no field 'nope'");
  EXPECT_EQ(complaint(R"({"msgid":0,"fields":{"type":-1}})"),
            "field 'type': -1 is not a whole number from 0 to 255");
  EXPECT_EQ(complaint(R"({"msgid":1,"fields":{"current_battery":32768}})"),
            "field 'current_battery': 32768 is not a whole number from -32768 to 32767");
  EXPECT_EQ(complaint(R"({"msgid":30,"fields":{"roll":1e39}})"),
            "field 'roll': 1e+39 is not a number that 32 bits hold");
  EXPECT_EQ(
      complaint(R"j({"msgid":30,"fields":{"roll":"NaN(0x00000001)"}})j"),
      R"j(field 'roll': "NaN(0x00000001)" is not a number, NaN, NaN(0x7fc00001), Infinity or -Infinity)j");
  EXPECT_EQ(complaint(R"({"msgid":22,"fields":{"param_id":"seventeen letters"}})"),
            R"(field 'param_id': "seventeen letters" is not at most 16 bytes)");
  EXPECT_EQ(complaint(R"({"msgid":82,"fields":{"q":[1,0,0]}})"), "field 'q': [1,0,0] is not an array of 4");
  EXPECT_EQ(complaint(R"({"msgid":77,"version":1,"fields":{"progress":1}})"),
            "field 'progress': is an extension: MAVLink 1 has none");
  EXPECT_EQ(complaint(R"({"msgid":0,"signed":true})"),
            "signature: null is not an object with link_id, timestamp and (without --key) hash");
  EXPECT_EQ(complaint(R"({"msgid":0,"signed":true,"signature":{"link_id":1,"timestamp":1,"hash":"0g"}})"),
            R"j(signature.hash: "0g" is not 12 hexadecimal digits (or give --key))j");
}

}  // namespace
}  // namespace roborun::mavlink
