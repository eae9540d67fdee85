/// A viewer of a flight (`roborun run --live`): hears topics of its log as messages of the Foxglove WebSocket protocol.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "platform/viewer/websocket.hpp"

namespace roborun::feed {

/// One thread. Never waits: a server that is not there, or ends, is tried again once per second.
class LiveClient {
 public:
  using Message = std::function<void(const std::string& topic, std::string_view json)>;
  /// `port` on 127.0.0.1. Of the others than `topics` nothing is asked for.
  LiveClient(std::uint16_t port, std::set<std::string> topics, Message message);
  ~LiveClient();
  LiveClient(const LiveClient&) = delete;
  LiveClient& operator=(const LiveClient&) = delete;

  void step(std::int64_t now_ns);
  [[nodiscard]] bool is_connected() const noexcept { return upgraded_; }

 private:
  void connect_to();
  void disconnect();
  [[nodiscard]] bool say(std::string_view bytes);
  /// False: the connection is over.
  [[nodiscard]] bool receive();
  [[nodiscard]] bool understand();
  [[nodiscard]] bool subscribe(std::string_view advertisement);

  std::uint16_t port_;
  std::set<std::string> wanted_;
  Message message_;
  int fd_{-1};
  bool upgraded_{false};
  std::int64_t next_try_ns_{0};
  std::string head_;  ///< Before the upgrade.
  viewer::FrameReader reader_{viewer::FrameReader::Peer::kServer};
  std::map<std::uint32_t, std::string> topic_;  ///< By subscription.
};

}  // namespace roborun::feed
