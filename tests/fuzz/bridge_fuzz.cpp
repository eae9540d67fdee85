/// Datagrams of the other machine, at either end of a PortBridge (first byte odd: the end that fetches) that knows the other one and its clock: each is a message, a
/// count, a length, and so many bytes behind a good header. Oracle: no port but those of its name is made, and none that is larger than promised.
#include <filesystem>

#include "platform/sensor_port/port_bridge.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace roborun::fuzz {
namespace {

using namespace sensor_port;

constexpr std::uint32_t kSession = 7;
constexpr Nanos kTick{10'000'000};

void nobody(std::span<const std::uint8_t>) {}

/// Says hello, and answers questions about the time at once.
void meet(PortBridge& bridge, MonotonicTime& now) {
  Datagram hello(BridgeMessage::kHello, kSession);
  hello.put(BridgeHello{});
  const auto take = [&](std::span<const std::uint8_t> bytes) { bridge.take(now, bytes, nobody); };
  hello.send(0, take);
  for (int i = 0; i < 100; ++i, now += kTick)
    bridge.step(now, [&](std::span<const std::uint8_t> bytes) {
      BridgeHeader header;
      BridgeHello question;
      if (!sensor_port::take(bytes, header) || header.message != BridgeMessage::kHello ||
          !sensor_port::take(bytes, question) || question.asked_ns == 0)
        return;
      Datagram time(BridgeMessage::kTime, kSession);
      time.put(BridgeTime{question.asked_ns, question.asked_ns + 1'000'000'000});
      time.send(0, take);
    });
  require(bridge.is_matched(), "the clocks are matched");
}

void hear(PortBridge& bridge, MonotonicTime now, Choices& choices) {
  const auto message = static_cast<BridgeMessage>(choices.byte() % 8U);
  const auto count = choices.number<std::uint16_t>();
  Datagram datagram(message, kSession);
  const auto body = choices.take(choices.number<std::uint16_t>() % (datagram.room_bytes() + 1));
  datagram.put_bytes(std::as_bytes(body));
  datagram.send(count, [&](std::span<const std::uint8_t> bytes) {
    refuse_or([&] { bridge.take(now, bytes, nobody); });
  });
}

}  // namespace
}  // namespace roborun::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roborun::fuzz;
  Choices choices(data, size);
  for (const auto& entry : std::filesystem::directory_iterator(roborun::test::scratch_folder()))
    std::filesystem::remove(entry.path());
  roborun::MonotonicTime now{roborun::Nanos{1'000'000'000'000}};
  {
    const BridgeEnd end = choices.byte() % 2U == 1 ? BridgeEnd::kFetches : BridgeEnd::kShares;
    PortBridge bridge(roborun::test::scratch("port"), end, 1);
    meet(bridge, now);
    for (; !choices.empty(); now += kTick) {
      hear(bridge, now, choices);
      bridge.step(now, nobody);
    }
  }
  for (const auto& entry : std::filesystem::directory_iterator(roborun::test::scratch_folder())) {
    const std::string name = entry.path().filename();
    require(name.starts_with("port-") && is_suffix(name.substr(5)), "a port has the vehicle's name");
    require(entry.file_size() <= 2 * PortReceiver::kMostFile_bytes,
            "a port has no more memory than promised");
  }
  return 0;
}
