#include "platform/feed/dds/live_client.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <utility>

#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"

namespace roborun::feed {
namespace {

using viewer::Opcode;

constexpr std::int64_t kRetry_ns = 1'000'000'000;
constexpr std::size_t kMostHead_bytes = 8192;
constexpr std::string_view kHeadEnd = "\r\n\r\n";

std::uint32_t number_of(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8U | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

}  // namespace

LiveClient::LiveClient(std::uint16_t port, std::set<std::string> topics, Message message)
    : port_(port), wanted_(std::move(topics)), message_(std::move(message)) {}

LiveClient::~LiveClient() { disconnect(); }

void LiveClient::disconnect() {
  if (fd_ >= 0) (void)close(fd_);
  fd_ = -1;
  upgraded_ = false;
  head_.clear();
  topic_.clear();
  reader_ = viewer::FrameReader(viewer::FrameReader::Peer::kServer);
}

bool LiveClient::say(std::string_view bytes) {
  return send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

void LiveClient::connect_to() {
  fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port_);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // On loopback this is done or refused at once.
  const bool is_there = fd_ >= 0 && connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  if (!is_there ||
      !say(fmt::format("GET / HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nUpgrade: WebSocket\r\nConnection: Upgrade\r\n"
                       "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: cm9ib3J1biBmZWVkIGRkcw==\r\n"
                       "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n",
                       port_)))
    disconnect();
}

bool LiveClient::receive() {
  std::array<char, 65536> bytes{};
  for (;;) {
    const ssize_t n = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno == EAGAIN || errno == EWOULDBLOCK;
    if (n == 0) return false;
    std::string_view got(bytes.data(), static_cast<std::size_t>(n));
    if (!upgraded_) {
      head_.append(got);
      const std::size_t end = head_.find(kHeadEnd);
      if (end == std::string::npos) {
        if (head_.size() > kMostHead_bytes) return false;
        continue;
      }
      if (!head_.starts_with("HTTP/1.1 101 ")) return false;
      upgraded_ = true;
      const std::string rest = head_.substr(end + kHeadEnd.size());
      reader_.feed(rest);
    } else {
      reader_.feed(got);
    }
    if (!understand()) return false;
  }
}

bool LiveClient::understand() {
  constexpr std::size_t kBody = 13;  // behind what it is, the subscription and the time
  for (viewer::FrameReader::Message message;;) {
    const auto status = reader_.next(message);
    if (status != viewer::FrameReader::Status::kMessage) return status == viewer::FrameReader::Status::kMore;
    if (message.opcode == Opcode::kClose) return false;
    if (message.opcode == Opcode::kText && !subscribe(message.payload)) return false;
    if (message.opcode != Opcode::kBinary || message.payload.size() < kBody || message.payload[0] != 1)
      continue;
    const std::string_view payload = message.payload;
    const auto topic = topic_.find(number_of(payload.substr(1)));
    if (topic != topic_.end()) message_(topic->second, payload.substr(kBody));
  }
}

bool LiveClient::subscribe(std::string_view advertisement) {
  try {
    const auto said = input::parse_json<nlohmann::json>(advertisement);
    if (said.at("op") != "advertise") return true;
    nlohmann::json all = nlohmann::json::array();
    for (const auto& channel : said.at("channels")) {
      const auto topic = channel.at("topic").get<std::string>();
      if (!wanted_.contains(topic)) continue;
      const auto id = channel.at("id").get<std::uint32_t>();
      topic_[id] = topic;
      all.push_back({{"id", id}, {"channelId", id}});
    }
    if (all.empty()) return true;
    return say(viewer::masked_frame(Opcode::kText,
                                    nlohmann::json{{"op", "subscribe"}, {"subscriptions", all}}.dump()));
  } catch (const std::exception&) {
    return false;  // no server of ours
  }
}

void LiveClient::step(std::int64_t now_ns) {
  if (fd_ < 0 && now_ns >= next_try_ns_) {
    next_try_ns_ = now_ns + kRetry_ns;
    connect_to();
  }
  if (fd_ >= 0 && !receive()) disconnect();
}

}  // namespace roborun::feed
