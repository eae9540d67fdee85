#include "platform/viewer/live_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "platform/input/input_error.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/viewer/websocket.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::viewer {
namespace {

using nlohmann::json;

/// A client that blocks; patient, because machines are slow.
class Peer {
 public:
  explicit Peer(std::uint16_t port) : port_(port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{60, 0};
    (void)setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Peer() { (void)close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void say(const std::string& bytes) const {
    EXPECT_EQ(send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  void subscribe(unsigned id, unsigned channel) const {
    const json one = {{"id", id}, {"channelId", channel}};
    say(masked_frame(Opcode::kText, json{{"op", "subscribe"}, {"subscriptions", {one}}}.dump()));
  }
  /// The answer to a request that ends the connection.
  std::string request(const std::string& line, const std::string& fields = {}) {
    say(line + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n" + fields + "\r\n");
    std::string all = rest_;
    while (more()) all += std::exchange(rest_, {});
    return all;
  }
  void upgrade() {
    say("GET / HTTP/1.1\r\nhost: localhost:" + std::to_string(port_) +
        "\r\nUpgrade: WebSocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: "
        "foxglove.websocket.v1\r\n\r\n");
    while (rest_.find("\r\n\r\n") == std::string::npos) ASSERT_TRUE(more());
    const std::size_t end = rest_.find("\r\n\r\n") + 4;
    EXPECT_TRUE(rest_.starts_with("HTTP/1.1 101 "));
    EXPECT_NE(rest_.find("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"), std::string::npos);
    rest_.erase(0, end);
  }
  struct Frame {
    Opcode opcode{};
    std::string payload;
  };
  std::optional<Frame> frame() {
    const auto need = [this](std::size_t bytes) {
      while (rest_.size() < bytes)
        if (!more()) return false;
      return true;
    };
    if (!need(2)) return std::nullopt;
    std::size_t head = 2;
    std::size_t length = static_cast<std::uint8_t>(rest_[1]);
    if (length >= 126) {
      const std::size_t bytes = length == 126 ? 2 : 8;
      head += bytes;
      if (!need(head)) return std::nullopt;
      length = 0;
      for (std::size_t i = 2; i < head; ++i) length = length << 8U | static_cast<std::uint8_t>(rest_[i]);
    }
    if (!need(head + length)) return std::nullopt;
    Frame result{static_cast<Opcode>(rest_[0] & 0x0F), rest_.substr(head, length)};
    rest_.erase(0, head + length);
    return result;
  }

 private:
  bool more() {
    std::array<char, 65536> bytes{};
    const ssize_t n = recv(fd_, bytes.data(), bytes.size(), 0);
    if (n > 0) rest_.append(bytes.data(), static_cast<std::size_t>(n));
    return n > 0;
  }
  int fd_{socket(AF_INET, SOCK_STREAM, 0)};
  std::uint16_t port_;
  std::string rest_;
};

struct Shown {
  std::uint32_t subscription{};
  std::int64_t time_ns{};
  std::string data;
};
Shown shown_in(const Peer::Frame& frame) {
  Shown shown;
  EXPECT_EQ(frame.opcode, Opcode::kBinary);
  EXPECT_EQ(frame.payload[0], '\x01');
  std::memcpy(&shown.subscription, frame.payload.data() + 1, 4);
  std::memcpy(&shown.time_ns, frame.payload.data() + 5, 8);
  shown.data = frame.payload.substr(13);
  return shown;
}

log::Channel channel(std::uint16_t id, const char* topic) { return {id, id, topic, "json", {}}; }
log::Schema schema(std::uint16_t id) { return {id, "test.Schema", "jsonschema", R"({"type":"object"})"}; }

class LiveServerTest : public testing::Test {
 protected:
  LiveServerTest() {
    sut.add(channel(1, "/state"), schema(1));
    sut.add(channel(2, "/decision"), schema(2));
    // The server knows them once it has looked.
    while (Peer(sut.port()).request("GET /").find("200 OK") == std::string::npos) {
    }
  }
  LiveServer sut{0, [] { return std::string("<html>page</html>"); }};
};

TEST_F(LiveServerTest, ServesThePageToItselfAlone) {
  const std::string good = Peer(sut.port()).request("GET /");
  EXPECT_TRUE(good.starts_with("HTTP/1.1 200 OK\r\n"));
  EXPECT_TRUE(good.ends_with("\r\n\r\n<html>page</html>"));
  EXPECT_NE(Peer(sut.port()).request("GET /x").find("404"), std::string::npos);
  EXPECT_NE(Peer(sut.port()).request("POST /").find("405"), std::string::npos);
  EXPECT_NE(Peer(sut.port()).request("GET /", "Origin: https://example.org\r\n").find("403"),
            std::string::npos);
  Peer named(sut.port());
  named.say("GET / HTTP/1.1\r\nHost: example.org\r\n");
  EXPECT_NE(named.request("X: y").find("403"), std::string::npos) << "a name of others that leads here";
  EXPECT_NE(Peer(sut.port()).request("GET /", "Upgrade: websocket\r\nSec-WebSocket-Key: x\r\n").find("400"),
            std::string::npos)
      << "another protocol";
}

TEST_F(LiveServerTest, SpeaksTheFoxgloveProtocol) {
  sut.show(2, 1'000'000'000, R"({"number":1})");
  Peer peer(sut.port());
  peer.upgrade();
  EXPECT_EQ(json::parse(peer.frame()->payload)["op"], "serverInfo");
  const json advertise = json::parse(peer.frame()->payload);
  EXPECT_EQ(advertise["op"], "advertise");
  ASSERT_EQ(advertise["channels"].size(), 2U);
  EXPECT_EQ(advertise["channels"][0], (json{{"id", 1},
                                            {"topic", "/state"},
                                            {"encoding", "json"},
                                            {"schemaName", "test.Schema"},
                                            {"schema", R"({"type":"object"})"},
                                            {"schemaEncoding", "jsonschema"}}));
  peer.subscribe(7, 2);
  Shown shown = shown_in(*peer.frame());
  EXPECT_EQ(shown.subscription, 7U);
  EXPECT_EQ(shown.time_ns, 1'000'000'000);
  EXPECT_EQ(shown.data, R"({"number":1})") << "the last one, although it came before";
  for (int i = 2; i < 10; ++i) sut.show(2, i, "{}");
  for (int i = 2; i < 10; ++i) EXPECT_EQ(shown_in(*peer.frame()).time_ns, i) << "all of them, in order";
  sut.show(1, 5, "{}");  // nobody asked for it
  peer.say(masked_frame(Opcode::kText, R"({"op":"unsubscribe","subscriptionIds":[7]})"));
  peer.say(masked_frame(Opcode::kText, "no JSON"));
  EXPECT_EQ(json::parse(peer.frame()->payload)["op"], "status");
  peer.say(masked_frame(Opcode::kPing, "still there"));
  const auto pong = peer.frame();
  EXPECT_EQ(pong->opcode, Opcode::kPong);
  EXPECT_EQ(pong->payload, "still there");
  peer.say("no frame at all");
  EXPECT_EQ(peer.frame()->opcode, Opcode::kClose);
  EXPECT_FALSE(peer.frame()) << "closed";
}

TEST_F(LiveServerTest, SendsTheNewestStateTenTimesASecond) {
  Peer peer(sut.port());
  peer.upgrade();
  (void)peer.frame();
  (void)peer.frame();
  peer.subscribe(1, 1);
  peer.say(masked_frame(Opcode::kPing, ""));
  EXPECT_EQ(peer.frame()->opcode, Opcode::kPong) << "subscribed by now";
  for (int i = 1; i <= 1000; ++i) sut.show(1, i, "{}");
  int messages = 0;
  for (std::int64_t time_ns = 0; time_ns < 1000; ++messages) time_ns = shown_in(*peer.frame()).time_ns;
  EXPECT_LT(messages, 100);
}

TEST_F(LiveServerTest, WaitsForNoViewer) {
  Peer dead(sut.port());
  dead.upgrade();
  dead.subscribe(1, 2);  // and never reads
  Peer half(sut.port());
  half.say("GET / HT");  // and never ends
  const std::string megabyte(1 << 20U, 'x');
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 200; ++i) sut.show(2, i, megabyte);
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_LT(took_s, 30.0) << "copies of 200 MB; a viewer that is waited for costs minutes";
  EXPECT_GT(sut.dropped(), 0U) << "the queue is bounded";
  EXPECT_TRUE(Peer(sut.port()).request("GET /").starts_with("HTTP/1.1 200")) << "others are served";
}

TEST(LiveServer, HasAPortOfItsOwn) {
  const LiveServer first(0, [] { return std::string(); });
  EXPECT_GT(first.port(), 0);
  try {
    const LiveServer second(first.port(), [] { return std::string(); });
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "--live: port " + std::to_string(first.port()) + " of 127.0.0.1: Address already in use");
  }
}

TEST(LiveServer, SaysThatTheFlightHasNotBegunOrWhyThereIsNoPage) {
  LiveServer sut(0, []() -> std::string { throw InputError("no log"); });
  EXPECT_NE(Peer(sut.port()).request("GET /").find("The flight has not begun.\n"), std::string::npos);
  sut.add(channel(1, "/state"), schema(1));
  std::string answer;
  do answer = Peer(sut.port()).request("GET /");
  while (answer.find("not begun") != std::string::npos);
  EXPECT_NE(answer.find("No page yet: no log\n"), std::string::npos);
}

TEST(LiveServer, ShowsTheTopicsOfALog) {
  LiveServer sut(0, [] { return std::string("page"); });
  log::FlightLog log(roborun::test::scratch("live.mcap"), false);
  log.show_to(sut);
  log.configure("{}", {});
  log::StateRecord state;
  state.phase = "mission";
  log.write(state);
  log.inputs(0, "bytes");
  while (Peer(sut.port()).request("GET /").find("200 OK") == std::string::npos) {
  }
  Peer peer(sut.port());
  peer.upgrade();
  std::map<std::string, unsigned> id;
  while (id.count("/result") == 0) {  // the last one; they may come in two messages
    const json told = json::parse(peer.frame()->payload);
    if (told["op"] != "advertise") continue;
    for (const json& one : told["channels"]) id[one["topic"].get<std::string>()] = one["id"].get<unsigned>();
  }
  EXPECT_EQ(id.count("/inputs"), 0U) << "they are for replays";
  for (const char* topic : {"/configuration", "/state", "/tf"}) {
    ASSERT_EQ(id.count(topic), 1U) << topic;
    peer.subscribe(id[topic], id[topic]);
    const Shown shown = shown_in(*peer.frame());
    EXPECT_EQ(shown.subscription, id[topic]);
    EXPECT_TRUE(json::parse(shown.data).is_object());
  }
}

}  // namespace
}  // namespace roborun::viewer
