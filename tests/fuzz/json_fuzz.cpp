/// JSON and lines from outside: missions of ground stations, messages for the bus and the link. The first byte chooses.
/// Oracle: heights, times and speeds of a mission are finite; a message that is accepted is the same behind its payload.
#include <cmath>

#include "firmware_if/mavlink/frame.hpp"
#include "platform/can/message_json.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/mavlink/message_json.hpp"
#include "platform/mavlink/mission_file.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace roborun;

void read_mission(const std::string& path) {
  const mavlink::MissionFile mission = mavlink::load_mission(path);
  fuzz::require(std::isfinite(mission.home_height_m), "home is somewhere");
  for (const mavlink::MissionItem& item : mission.items) {
    fuzz::require(std::isfinite(item.height_m) && std::isfinite(item.hold_s) && std::isfinite(item.speed_mps),
                  "numbers of an item are finite");
    fuzz::require(!item.place || (std::fabs(item.place->latitude_deg) <= 90.0 &&
                                  std::fabs(item.place->longitude_deg) <= 180.0),
                  "places are on the earth");
  }
}

void read_can_message(const std::string& text, std::size_t type_index) {
  const auto& type =
      firmware_if::dronecan::kAllTypes.at(type_index % firmware_if::dronecan::kAllTypes.size());
  const auto json = input::parse_json(text);
  try {
    const std::vector<std::uint8_t> payload = can::from_json(type, json);
    fuzz::require(can::from_json(type, can::to_json(type, payload)) == payload,
                  "a message is the same behind JSON");
  } catch (const can::MessageError&) {  // refused
  }
}

void read_mavlink_message(const std::string& text) {
  const std::vector<std::uint8_t> bytes = mavlink::from_json(input::parse_json(text), 7, nullptr);
  firmware_if::mavlink::Frame frame;
  fuzz::require(firmware_if::mavlink::read_frame(bytes, frame) == firmware_if::mavlink::FrameState::kComplete,
                "what JSON gives is a frame");
  (void)mavlink::to_json(frame);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Choices choices(data, size);
  const std::uint8_t what = choices.byte();
  const auto bytes = choices.rest();
  const std::string text(bytes.begin(), bytes.end());
  fuzz::refuse_or([&] {
    switch (what % 4U) {
      case 0:
        read_mission(fuzz::file("m.plan", bytes));
        break;
      case 1:
        read_mission(fuzz::file("m.waypoints", bytes));
        break;
      case 2:
        read_can_message(text, what / 4U);
        break;
      default:
        read_mavlink_message(text);
    }
  });
  return 0;
}
