#include "platform/viewer/live_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <system_error>

#include "platform/input/input_error.hpp"
#include "platform/input/json_reader.hpp"
#include "platform/viewer/websocket.hpp"

namespace roborun::viewer {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

constexpr std::chrono::milliseconds kPeriod{100};
constexpr std::chrono::seconds kPatience{30};
constexpr std::size_t kMostRequest_bytes = 16U << 10U;
constexpr const char* kProtocol = "foxglove.websocket.v1";
constexpr std::uint8_t kMessageData = 1;  // opcode of the Foxglove protocol

template <typename T>
void append_number(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value),
            sizeof value);  // little-endian, as the protocol and our machines
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

/// The value of a field of an HTTP request, without blanks around; empty: there is none.
std::string field_of(std::string_view head, std::string_view name) {
  for (std::size_t at = head.find("\r\n"); at != std::string_view::npos; at = head.find("\r\n", at + 2)) {
    std::string_view line = head.substr(at + 2);
    line = line.substr(0, line.find("\r\n"));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos || lower(line.substr(0, colon)) != name) continue;
    line.remove_prefix(colon + 1);
    while (line.starts_with(' ')) line.remove_prefix(1);
    while (line.ends_with(' ')) line.remove_suffix(1);
    return std::string(line);
  }
  return {};
}

std::string response(const char* status, const char* type, std::string_view body) {
  return fmt::format(
      "HTTP/1.1 {}\r\nContent-Type: {}; charset=utf-8\r\nContent-Length: {}\r\nCache-Control: no-store\r\n"
      "Connection: close\r\n\r\n{}",
      status, type, body.size(), body);
}

}  // namespace

class LiveServer::Client {
 public:
  explicit Client(int fd) : fd_(fd) {}
  ~Client() { (void)close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] pollfd wish() const {
    return {fd_, static_cast<short>((is_ending() ? 0 : POLLIN) | (pending_bytes() > 0 ? POLLOUT : 0)), 0};
  }
  [[nodiscard]] bool is_done() const {
    const bool owes = pending_bytes() > 0 || !is_viewer;
    return gone_ || (closing_ && pending_bytes() == 0) || (owes && Clock::now() - last_progress_ > kPatience);
  }
  /// Everything that is there, at most what a request may have.
  void receive() {
    std::array<char, 4096> bytes{};
    while (in_.size() < kMostRequest_bytes) {
      const ssize_t n = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (n > 0) {
        in_.append(bytes.data(), static_cast<std::size_t>(n));
        continue;
      }
      if (n < 0 && errno == EINTR) continue;
      gone_ = gone_ || n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
      return;
    }
  }
  void send_pending() {
    while (pending_bytes() > 0) {
      const ssize_t n = send(fd_, out_.data() + sent_, pending_bytes(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (n > 0) {
        sent_ += static_cast<std::size_t>(n);
        last_progress_ = Clock::now();
        continue;
      }
      if (n < 0 && errno == EINTR) continue;
      gone_ = gone_ || (errno != EAGAIN && errno != EWOULDBLOCK);
      break;
    }
    out_.erase(0, sent_);
    sent_ = 0;
  }
  void put(std::string_view bytes) {
    if (pending_bytes() == 0) last_progress_ = Clock::now();
    out_.append(bytes);
  }
  void put(Opcode opcode, std::string_view payload) {
    std::string frame;
    append_frame(frame, opcode, payload);
    put(frame);
  }
  /// Of a channel that it has subscribed to. Left out where the viewer does not keep up.
  void tell(std::uint16_t channel, std::string_view body) {
    const auto at = subscription.find(channel);
    if (at == subscription.end() || pending_bytes() + body.size() > kMostPending_bytes) return;
    std::string message(1, static_cast<char>(kMessageData));
    append_number(message, at->second);
    message.append(body);
    put(Opcode::kBinary, message);
  }
  void end() { closing_ = true; }
  [[nodiscard]] bool is_ending() const { return closing_ || gone_; }
  [[nodiscard]] std::string& in() { return in_; }

  bool is_viewer{false};  ///< It speaks WebSocket by now.
  FrameReader reader;
  std::map<std::uint16_t, std::uint32_t> subscription;  ///< By channel.

 private:
  [[nodiscard]] std::size_t pending_bytes() const { return out_.size() - sent_; }

  int fd_;
  bool gone_{false}, closing_{false};
  std::string in_, out_;
  std::size_t sent_{0};
  Clock::time_point last_progress_{Clock::now()};
};

LiveServer::LiveServer(std::uint16_t port, std::function<std::string()> page) : page_(std::move(page)) {
  const auto fail = [this, port](int error) {
    if (listener_ >= 0) (void)close(listener_);
    throw InputError(
        fmt::format("--live: port {} of 127.0.0.1: {}", port, std::generic_category().message(error)));
  };
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) fail(errno);
  const int on = 1;
  (void)setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, static_cast<int>(kMostClients)) != 0 ||
      getsockname(listener_, generic, &size) != 0)
    fail(errno);
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { run(); });
}

LiveServer::~LiveServer() {
  stopping_.store(true, std::memory_order_release);
  thread_.join();
  (void)close(listener_);
}

void LiveServer::add(const log::Channel& channel, const log::Schema& schema) {
  static const std::set<std::string_view> kNewestOnly{"/state", "/pose", "/tf", "/path"};
  const Json advertised = {
      {"id", channel.id},          {"topic", channel.topic}, {"encoding", channel.message_encoding},
      {"schemaName", schema.name}, {"schema", schema.data},  {"schemaEncoding", schema.encoding}};
  const std::lock_guard lock(mutex_);
  added_.emplace_back(channel.id,
                      Channel{channel.topic, advertised.dump(), {}, kNewestOnly.contains(channel.topic)});
}

void LiveServer::show(std::uint16_t channel, std::int64_t time_ns, std::string_view json) noexcept {
  try {
    Queued queued{channel, {}};
    append_number(queued.body, time_ns);
    queued.body.append(json);
    const std::lock_guard lock(mutex_);
    if (queued_bytes_ + queued.body.size() > kMostPending_bytes) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    queued_bytes_ += queued.body.size();
    queue_.push_back(std::move(queued));
  } catch (...) {
    dropped_.fetch_add(1, std::memory_order_relaxed);
  }
}

std::vector<LiveServer::Queued> LiveServer::take_queue() {
  std::deque<Queued> queue;
  std::vector<std::pair<std::uint16_t, Channel>> added;
  {
    const std::lock_guard lock(mutex_);
    queue.swap(queue_);
    added.swap(added_);
    queued_bytes_ = 0;
  }
  for (auto& [id, channel] : added) {
    for (const auto& client : clients_)
      if (client->is_viewer)
        client->put(Opcode::kText,
                    fmt::format(R"({{"op":"advertise","channels":[{}]}})", channel.advertised));
    channels_[id] = std::move(channel);
  }
  std::vector<Queued> messages;
  std::set<std::uint16_t> newer;  // channels of which a newer message follows
  for (auto at = queue.rbegin(); at != queue.rend(); ++at) {
    const bool is_newest = newer.insert(at->channel).second;
    if (is_newest) channels_[at->channel].last = at->body;
    if (is_newest || !channels_[at->channel].newest_only) messages.push_back(std::move(*at));
  }
  std::reverse(messages.begin(), messages.end());
  return messages;
}

void LiveServer::send_all(const std::vector<Queued>& messages) {
  for (const auto& client : clients_)
    for (const Queued& message : messages) client->tell(message.channel, message.body);
}

void LiveServer::run() {
  Clock::time_point next = Clock::now() + kPeriod;
  while (!stopping_.load(std::memory_order_acquire)) {
    try {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(next - Clock::now()).count();
      std::vector<pollfd> wishes{{listener_, POLLIN, 0}};
      for (const auto& client : clients_) wishes.push_back(client->wish());
      (void)poll(wishes.data(), wishes.size(), static_cast<int>(std::max<std::int64_t>(left, 0)));
      if (wishes[0].revents != 0) accept_client();
      serve_once();
      if (Clock::now() < next) continue;
      next = Clock::now() + kPeriod;
      send_all(take_queue());
    } catch (const std::bad_alloc&) {
      clients_.clear();  // viewers go before the flight does
    }
  }
  end_all();
}

void LiveServer::end_all() noexcept {
  try {
    send_all(take_queue());
    for (const auto& client : clients_) {
      if (client->is_viewer) client->put(Opcode::kClose, "\x03\xE9");  // 1001
      client->send_pending();
    }
  } catch (...) {
  }
  clients_.clear();
}

void LiveServer::accept_client() {
  const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  if (clients_.size() >= kMostClients)
    (void)close(fd);
  else
    clients_.push_back(std::make_unique<Client>(fd));
}

void LiveServer::serve_once() {
  for (const auto& client : clients_) {
    client->receive();
    if (!client->is_ending()) answer(*client);
    client->send_pending();
  }
  std::erase_if(clients_, [](const auto& client) { return client->is_done(); });
}

void LiveServer::answer(Client& client) {
  if (!client.is_viewer) {
    const std::size_t end = client.in().find("\r\n\r\n");
    if (end == std::string::npos) {
      if (client.in().size() >= kMostRequest_bytes) client.end();
      return;
    }
    const std::string head = client.in().substr(0, end);
    client.in().erase(0, end + 4);
    answer_request(client, head);
    if (!client.is_viewer) return client.end();
  }
  client.reader.feed(client.in());
  client.in().clear();
  FrameReader::Message message;
  while (!client.is_ending()) {
    const FrameReader::Status status = client.reader.next(message);
    if (status == FrameReader::Status::kMore) return;
    if (status == FrameReader::Status::kBad || message.opcode == Opcode::kClose) {
      client.put(Opcode::kClose,
                 status == FrameReader::Status::kBad ? "\x03\xEA" : "\x03\xE8");  // 1002, 1000
      client.end();
    } else if (message.opcode == Opcode::kPing) {
      client.put(Opcode::kPong, message.payload);
    } else if (message.opcode == Opcode::kText) {
      answer_message(client, message.payload);
    }
  }
}

/// Pages of other sites, and names that lead here, get nothing: the browser of somebody who flies is also open to them.
void LiveServer::answer_request(Client& client, std::string_view head) {
  const std::string origin = field_of(head, "origin");
  const std::string host = field_of(head, "host");
  bool own_host = false;
  bool own_origin = origin.empty() || origin == "https://app.foxglove.dev" || origin == "file://";
  for (const char* name : {"127.0.0.1", "localhost"}) {
    const std::string here = fmt::format("{}:{}", name, port_);
    own_host = own_host || host == here;
    own_origin = own_origin || origin == "http://" + here;
  }
  if (!own_host || !own_origin) {
    client.put(response("403 Forbidden", "text/plain", "Only pages of this server and Foxglove may look.\n"));
    return;
  }
  const std::string_view line = head.substr(0, head.find("\r\n"));
  if (!line.starts_with("GET ")) {
    client.put(response("405 Method Not Allowed", "text/plain", "Only GET.\n"));
    return;
  }
  const std::string key = field_of(head, "sec-websocket-key");
  if (lower(field_of(head, "upgrade")) == "websocket" && !key.empty()) {
    if (field_of(head, "sec-websocket-protocol").find(kProtocol) == std::string::npos) {
      client.put(response("400 Bad Request", "text/plain", fmt::format("The protocol is {}.\n", kProtocol)));
      return;
    }
    client.put(
        fmt::format("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                    "Sec-WebSocket-Accept: {}\r\nSec-WebSocket-Protocol: {}\r\n\r\n",
                    accept_key(key), kProtocol));
    client.is_viewer = true;
    client.put(Opcode::kText, R"({"op":"serverInfo","name":"roborun","capabilities":[]})");
    std::string channels;
    for (const auto& [id, channel] : channels_)
      channels += (channels.empty() ? "" : ",") + channel.advertised;
    client.put(Opcode::kText, fmt::format(R"({{"op":"advertise","channels":[{}]}})", channels));
    return;
  }
  if (!line.starts_with("GET / ")) {
    client.put(response("404 Not Found", "text/plain", "There is / alone.\n"));
    return;
  }
  if (channels_.empty()) {
    client.put(
        response("503 Service Unavailable\r\nRefresh: 1", "text/plain", "The flight has not begun.\n"));
    return;
  }
  try {
    client.put(response("200 OK", "text/html", page_()));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    client.put(response("503 Service Unavailable\r\nRefresh: 1", "text/plain",
                        fmt::format("No page yet: {}\n", error.what())));
  }
}

void LiveServer::answer_message(Client& client, std::string_view json) {
  const auto number = [](const Json& value, std::uint64_t most) -> std::optional<std::uint64_t> {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > most) return std::nullopt;
    return value.get<std::uint64_t>();
  };
  try {
    const Json message = input::parse_json(json);
    const std::string op = message.at("op").get<std::string>();
    if (op == "subscribe") {
      for (const Json& one : message.at("subscriptions")) {
        const auto id = number(one.at("id"), UINT32_MAX);
        const auto channel = number(one.at("channelId"), UINT16_MAX);
        if (!id || !channel) continue;
        const auto known = channels_.find(static_cast<std::uint16_t>(*channel));
        if (known == channels_.end()) continue;
        client.subscription[known->first] = static_cast<std::uint32_t>(*id);
        if (!known->second.last.empty()) client.tell(known->first, known->second.last);
      }
    } else if (op == "unsubscribe") {
      for (const Json& id : message.at("subscriptionIds"))
        std::erase_if(client.subscription, [&](const auto& entry) { return Json(entry.second) == id; });
    }
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    client.put(Opcode::kText, R"({"op":"status","level":1,"message":"not understood"})");
  }
}

}  // namespace roborun::viewer
