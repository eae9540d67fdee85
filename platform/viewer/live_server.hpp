/// Shows a flight while it goes on: on loopback a page and the Foxglove WebSocket protocol (foxglove.websocket.v1), with the topics
/// of its log.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "platform/log/flight_log.hpp"

namespace roborun::viewer {

/// Its own thread sends ten times a second: of states and poses the newest, of the other topics all. Whoever subscribes gets the
/// last message of the topic at once. A viewer that reads slowly misses messages; one that reads nothing for kPatience is cut off.
/// Neither is waited for: show() copies into a queue of bounded size under a lock that is held for no input or output.
class LiveServer final : public log::LogViewer {
 public:
  static constexpr std::size_t kMostClients = 8;
  static constexpr std::size_t kMostPending_bytes = 8U << 20U;  ///< In the queue, and for each client.

  /// Listens on 127.0.0.1; `port` 0: a free one. `page` gives what GET / shows, in the server's thread; what it throws becomes the
  /// text of a page. Throws InputError "--live: ...".
  LiveServer(std::uint16_t port, std::function<std::string()> page);
  ~LiveServer() override;
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  void add(const log::Channel& channel, const log::Schema& schema) override;
  void show(std::uint16_t channel, std::int64_t time_ns, std::string_view json) noexcept override;
  /// Messages that a full queue lost, for all viewers; never decreases.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  class Client;
  struct Channel {
    std::string topic, advertised;  ///< As JSON.
    std::string last;               ///< Its last message: time and data as they are sent.
    bool newest_only{};
  };
  struct Queued {
    std::uint16_t channel{};
    std::string body;
  };

  void run();
  void serve_once();
  void send_all(const std::vector<Queued>& messages);
  [[nodiscard]] std::vector<Queued> take_queue();
  /// What is left, as far as it can be sent at once.
  void end_all() noexcept;
  void accept_client();
  void answer(Client& client);
  void answer_request(Client& client, std::string_view head);
  void answer_message(Client& client, std::string_view json);

  std::function<std::string()> page_;
  int listener_{-1};
  std::uint16_t port_{0};
  std::map<std::uint16_t, Channel> channels_;  ///< Of the thread.
  std::vector<std::unique_ptr<Client>> clients_;
  std::mutex mutex_;  ///< Of the following.
  std::vector<std::pair<std::uint16_t, Channel>> added_;
  std::deque<Queued> queue_;
  std::size_t queued_bytes_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace roborun::viewer
