/// A MAVLink connection of the operating system: UDP, TCP, or a serial line. Bytes there and back; what they mean is
/// firmware_if/mavlink's affair.
#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "firmware_if/time.hpp"

namespace roborun::mavlink {

/// Where to.
struct LinkAddress {
  enum class Kind : std::uint8_t { kUdpOut, kUdpIn, kTcp, kSerial };
  Kind kind{Kind::kUdpOut};
  std::string host{};  ///< Of serial lines the device.
  int number{};        ///< Port, or baud.
};

/// udpout://HOST:PORT (sends there, whoever answers from there is heard), udpin://[HOST]:PORT (waits there; who speaks first is
/// the peer until it was silent for kPeerPatience), tcp://HOST:PORT (client), serial:///dev/ttyACM0:921600. Throws InputError
/// that says which of it is wrong. HOST is an IPv4 address or localhost: no look-up that could block.
[[nodiscard]] LinkAddress parse_link(const std::string& url);

/// Contract:
///  1. read() and write() neither block nor allocate. A connection that is not there, or that broke, is opened again by read(),
///  once per kRetry at most: a plug pulled and put back, a server that restarts.
///  2. What cannot be sent at once is dropped and counted, whole frames of it on UDP: set-points are worth nothing later.
///  3. Nothing is believed: a datagram of any sender but the peer is dropped and counted.
/// One thread.
class Link {
 public:
  static constexpr Nanos kRetry{500'000'000};
  static constexpr Nanos kPeerPatience{5'000'000'000};
  static constexpr std::size_t kDatagram_bytes = 1400;  ///< At most so many are sent in one.
  struct Counters {
    std::uint64_t opened{}, lost{}, bytes_in{}, bytes_out{}, bytes_dropped{}, foreign_datagrams{};
  };

  explicit Link(const LinkAddress& address) : address_(address) {}
  ~Link() { close(); }
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// How many bytes came; 0: none now. Datagrams that are longer than `bytes` are cut: give 2,048 at least.
  [[nodiscard]] std::size_t read(MonotonicTime now, std::span<std::uint8_t> bytes) noexcept;
  /// How many bytes left.
  std::size_t write(MonotonicTime now, std::span<const std::uint8_t> frames) noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0 && !connecting_; }
  /// To wait on with poll(); -1: closed.
  [[nodiscard]] int fd() const noexcept { return fd_; }
  /// Why the last attempt to open it failed: an errno, 0: it did not.
  [[nodiscard]] int why() const noexcept { return why_; }
  /// The port that a udpin link waits on (of 0: which one it became); 0: closed.
  [[nodiscard]] int local_port() const noexcept;
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  void open(MonotonicTime now) noexcept;
  void open_socket(int type) noexcept;
  void open_serial() noexcept;
  void finish_connect() noexcept;
  void close() noexcept;
  void lose(int error) noexcept;
  [[nodiscard]] bool is_udp() const noexcept {
    return address_.kind == LinkAddress::Kind::kUdpOut || address_.kind == LinkAddress::Kind::kUdpIn;
  }

  LinkAddress address_;
  int fd_{-1};
  int why_{0};
  bool connecting_{false};
  bool tried_{false};
  MonotonicTime tried_at_{};
  sockaddr_in peer_{};
  bool has_peer_{false};
  MonotonicTime heard_{};
  Counters counters_{};
};

}  // namespace roborun::mavlink
