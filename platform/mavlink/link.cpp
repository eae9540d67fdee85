#include "platform/mavlink/link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "firmware_if/mavlink/frame.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::mavlink {
namespace {

using Kind = LinkAddress::Kind;

constexpr std::array<std::pair<int, speed_t>, 9> kBauds{{{9600, B9600},
                                                         {19200, B19200},
                                                         {38400, B38400},
                                                         {57600, B57600},
                                                         {115200, B115200},
                                                         {230400, B230400},
                                                         {460800, B460800},
                                                         {921600, B921600},
                                                         {1500000, B1500000}}};

const char* scheme_of(Kind kind) noexcept {
  constexpr std::array<const char*, 4> kNames{"udpout", "udpin", "tcp", "serial"};
  return kNames.at(static_cast<std::size_t>(kind));
}

sockaddr_in socket_address(const LinkAddress& address) noexcept {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(static_cast<std::uint16_t>(address.number));
  (void)inet_pton(AF_INET, address.host.c_str(), &out.sin_addr);
  return out;
}

/// The calls of sockets want the general type.
sockaddr* general(sockaddr_in& address) noexcept {
  return reinterpret_cast<sockaddr*>(&address);  // NOLINT(*-reinterpret-cast)
}

bool same(const sockaddr_in& a, const sockaddr_in& b) noexcept {
  return a.sin_port == b.sin_port && a.sin_addr.s_addr == b.sin_addr.s_addr;
}

/// Of the whole frames at the front as many as fit; at least one, and never less than what is no frame.
std::size_t datagram_of(std::span<const std::uint8_t> frames) noexcept {
  using namespace firmware_if::mavlink;  // NOLINT(google-build-using-namespace)
  std::size_t at = 0;
  while (at < frames.size()) {
    std::size_t length = frames.size() - at;
    if (frames[at] == kStart2 && length > 2) {
      const std::size_t signature = (frames[at + 2] & kSignedFlag) != 0 ? kSignatureBlock_bytes : 0;
      length = std::min(length, kHeader2_bytes + frames[at + 1] + kCrc_bytes + signature);
    }
    if (at > 0 && at + length > Link::kDatagram_bytes) break;
    at += length;
  }
  return at;
}

}  // namespace

LinkAddress parse_link(const std::string& url) {
  const auto complain = [&url](const std::string& what) {
    return InputError(
        fmt::format("{}: {}: must be udpout://HOST:PORT, udpin://[HOST]:PORT, tcp://HOST:PORT or "
                    "serial:///dev/NAME:BAUD",
                    url, what));
  };
  const std::size_t colon = url.find("://");
  if (colon == std::string::npos) throw complain("no link");
  LinkAddress address;
  const std::string scheme = url.substr(0, colon);
  bool known = false;
  for (const Kind kind : {Kind::kUdpOut, Kind::kUdpIn, Kind::kTcp, Kind::kSerial}) {
    if (scheme != scheme_of(kind)) continue;
    address.kind = kind;
    known = true;
  }
  if (!known) throw complain("unknown kind of link");
  const std::string rest = url.substr(colon + 3);
  const std::size_t last = rest.rfind(':');
  const std::string number = last == std::string::npos ? "" : rest.substr(last + 1);
  address.host = rest.substr(0, last);
  const auto read = std::from_chars(number.data(), number.data() + number.size(), address.number);
  const bool whole = !number.empty() && read.ec == std::errc{} && read.ptr == number.data() + number.size();
  if (address.kind == Kind::kSerial) {
    const auto fits = [&address](const auto& baud) { return baud.first == address.number; };
    if (address.host.empty() || address.host.front() != '/') throw complain("no device");
    if (!whole || std::none_of(kBauds.begin(), kBauds.end(), fits))
      throw complain("unknown baud rate (9600 to 921600, 1500000)");
    return address;
  }
  const int least = address.kind == Kind::kUdpIn ? 0 : 1;
  if (!whole || address.number < least || address.number > 65535) throw complain("no port");
  if (address.host == "localhost") address.host = "127.0.0.1";
  if (address.host.empty() && address.kind == Kind::kUdpIn) address.host = "0.0.0.0";
  in_addr parsed{};
  if (inet_pton(AF_INET, address.host.c_str(), &parsed) != 1) throw complain("no IPv4 address");
  return address;
}

void Link::close() noexcept {
  if (fd_ >= 0) (void)::close(fd_);
  fd_ = -1;
  connecting_ = false;
  has_peer_ = false;
}

void Link::lose(int error) noexcept {
  if (is_open()) ++counters_.lost;
  why_ = error;
  close();
}

void Link::open_socket(int type) noexcept {
  fd_ = ::socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) return lose(errno);
  sockaddr_in address = socket_address(address_);
  int result = 0;
  if (address_.kind == Kind::kUdpIn) {
    result = ::bind(fd_, general(address), sizeof address);
  } else {
    if (address_.kind == Kind::kUdpOut) {
      peer_ = address;
      has_peer_ = true;
      return;
    }
    result = ::connect(fd_, general(address), sizeof address);
    if (result != 0 && errno == EINPROGRESS) {
      connecting_ = true;
      return;
    }
  }
  if (result != 0) lose(errno);
}

void Link::open_serial() noexcept {
  fd_ = ::open(address_.host.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) return lose(errno);
  termios settings{};
  if (tcgetattr(fd_, &settings) != 0) return lose(errno);
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  for (const auto& [baud, speed] : kBauds) {
    if (baud != address_.number) continue;
    (void)cfsetispeed(&settings, speed);
    (void)cfsetospeed(&settings, speed);
  }
  if (tcsetattr(fd_, TCSANOW, &settings) != 0) lose(errno);
}

void Link::open(MonotonicTime now) noexcept {
  if (tried_ && now - tried_at_ < kRetry) return;
  tried_ = true;
  tried_at_ = now;
  why_ = 0;
  if (address_.kind == Kind::kSerial) {
    open_serial();
  } else {
    open_socket(is_udp() ? SOCK_DGRAM : SOCK_STREAM);
  }
  if (is_open()) ++counters_.opened;
}

void Link::finish_connect() noexcept {
  pollfd waiting{fd_, POLLOUT, 0};
  if (::poll(&waiting, 1, 0) <= 0) return;
  int error = 0;
  socklen_t size = sizeof error;
  if (getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
  if (error != 0) return lose(error);
  connecting_ = false;
  ++counters_.opened;
}

int Link::local_port() const noexcept {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (fd_ < 0 || getsockname(fd_, general(address), &size) != 0) return 0;
  return ntohs(address.sin_port);
}

std::size_t Link::read(MonotonicTime now, std::span<std::uint8_t> bytes) noexcept {
  if (fd_ < 0) open(now);
  if (connecting_) finish_connect();
  if (!is_open() || bytes.empty()) return 0;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t count = is_udp() ? ::recvfrom(fd_, bytes.data(), bytes.size(), 0, general(from), &size)
                                 : ::read(fd_, bytes.data(), bytes.size());
  if (count < 0) {
    // A refused datagram (nobody listens there yet) is no reason to close.
    const bool harmless = errno == EAGAIN || errno == EINTR || (is_udp() && errno == ECONNREFUSED);
    if (!harmless) lose(errno);
    return 0;
  }
  if (count == 0) {
    // The end of a stream; of a serial line, whose VMIN is 1, only a hang-up reads so.
    if (!is_udp()) lose(ECONNRESET);
    return 0;
  }
  if (is_udp()) {
    const bool replaces = address_.kind == Kind::kUdpIn && (!has_peer_ || now - heard_ > kPeerPatience);
    if (replaces) {
      peer_ = from;
      has_peer_ = true;
    } else if (!same(from, peer_)) {
      ++counters_.foreign_datagrams;
      return 0;
    }
    heard_ = now;
  }
  counters_.bytes_in += static_cast<std::uint64_t>(count);
  return static_cast<std::size_t>(count);
}

std::size_t Link::write(MonotonicTime now, std::span<const std::uint8_t> frames) noexcept {
  (void)now;
  std::size_t left = 0;
  while (is_open() && left < frames.size() && (!is_udp() || has_peer_)) {
    const auto rest = frames.subspan(left);
    const std::size_t wanted = is_udp() ? datagram_of(rest) : rest.size();
    ssize_t count = 0;
    if (is_udp())
      count = ::sendto(fd_, rest.data(), wanted, MSG_NOSIGNAL, general(peer_), sizeof peer_);
    else if (address_.kind == Kind::kTcp)
      count = ::send(fd_, rest.data(), wanted, MSG_NOSIGNAL);
    else
      count = ::write(fd_, rest.data(), wanted);
    if (count <= 0) {
      const bool full = count == 0 || errno == EAGAIN || errno == EINTR || errno == ENOBUFS;
      if (!full && !is_udp()) lose(errno);
      break;
    }
    left += static_cast<std::size_t>(count);
  }
  counters_.bytes_out += left;
  counters_.bytes_dropped += frames.size() - left;
  return left;
}

}  // namespace roborun::mavlink
