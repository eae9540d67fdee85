#include "platform/can/socket_can.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/sock_diag.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace roborun::can {
namespace {

using firmware_if::CanFrame;
using firmware_if::CanState;

constexpr int kQueue_frames = 128;
constexpr int kFrameCost_bytes = 1024;  ///< What the kernel charges a socket for one frame, rounded up.
constexpr int kReceiveBuffer_bytes = 1 << 20;
constexpr Nanos kOldestStamp{100'000'000};
constexpr int kMostErrorFrames =
    16;  ///< Read in one receive(), so that a storm of them cannot hold the loop.

Nanos read_clock(clockid_t id) noexcept {
  timespec t{};
  (void)clock_gettime(id, &t);
  return Nanos{std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec};
}

template <typename T>
bool set_option(int socket, int level, int name, const T& value) {
  return setsockopt(socket, level, name, &value, sizeof(value)) == 0;
}

/// Empty: good.
std::string prepare(int fd, const std::string& interface) {
  ifreq request{};
  if (interface.size() >= sizeof(request.ifr_name)) return "name is too long";
  std::copy(interface.begin(), interface.end(), std::begin(request.ifr_name));
  if (ioctl(fd, SIOCGIFTXQLEN, &request) != 0) return std::strerror(errno);
  if (request.ifr_qlen < kQueue_frames)
    return fmt::format("its queue holds {} frames: must be at least {}: ip link set {} txqueuelen {}",
                       request.ifr_qlen, kQueue_frames, interface, kQueue_frames);
  if (ioctl(fd, SIOCGIFINDEX, &request) != 0) return std::strerror(errno);
  const int index = request.ifr_ifindex;
  if (ioctl(fd, SIOCGIFFLAGS, &request) != 0) return std::strerror(errno);
  if ((request.ifr_flags & IFF_UP) == 0) return fmt::format("is down: ip link set {} up", interface);
  const can_filter extended{CAN_EFF_FLAG, CAN_EFF_FLAG | CAN_RTR_FLAG};
  // The kernel doubles what is asked of SO_SNDBUF.
  const bool good = set_option(fd, SOL_CAN_RAW, CAN_RAW_FILTER, extended) &&
                    set_option(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK}) &&
                    set_option(fd, SOL_SOCKET, SO_SNDBUF, kQueue_frames * kFrameCost_bytes / 2) &&
                    set_option(fd, SOL_SOCKET, SO_RCVBUF, kReceiveBuffer_bytes) &&
                    set_option(fd, SOL_SOCKET, SO_TIMESTAMPNS, 1) &&
                    set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1);
  if (!good) return std::strerror(errno);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  // The socket API is written in terms of sockaddr.
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)  // NOLINT
    return std::strerror(errno);
  return {};
}

bool valid(std::span<const CanFrame> transfer) noexcept {
  return !transfer.empty() && transfer.size() <= firmware_if::CanBus::kMostFrames &&
         std::ranges::all_of(
             transfer, [](const CanFrame& f) { return f.id <= CAN_EFF_MASK && f.size <= CAN_MAX_DLEN; });
}

/// Whether the socket takes `frames` more without asking anybody to wait.
bool has_room(int fd, std::size_t frames) noexcept {
  std::array<std::uint32_t, SK_MEMINFO_VARS> memory{};
  socklen_t size = sizeof(memory);
  if (getsockopt(fd, SOL_SOCKET, SO_MEMINFO, memory.data(), &size) != 0) return true;
  return memory[SK_MEMINFO_WMEM_ALLOC] + frames * kFrameCost_bytes <= memory[SK_MEMINFO_SNDBUF];
}

}  // namespace

CanErrorReport classify_error(const can_frame& frame) noexcept {
  CanErrorReport report;
  const canid_t kind = frame.can_id & CAN_ERR_MASK;
  report.bus_off = (kind & CAN_ERR_BUSOFF) != 0;
  report.restarted = (kind & CAN_ERR_RESTARTED) != 0;
  report.no_acknowledge = (kind & CAN_ERR_ACK) != 0;
  if ((kind & CAN_ERR_CRTL) != 0) {
    report.passive = (frame.data[1] & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0;
    report.active = (frame.data[1] & CAN_ERR_CRTL_ACTIVE) != 0;
  }
  return report;
}

SocketCan::~SocketCan() {
  const int fd = socket_.exchange(-1);
  if (fd >= 0) (void)close(fd);
}

std::string SocketCan::open(const std::string& interface, Nanos epoch) {
  interface_ = interface;
  epoch_ = epoch;
  std::string why = connect();
  if (why.empty()) state_ = CanState::kActive;
  return why;
}

std::string SocketCan::connect() {
  const std::string& interface = interface_;
  const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0) return fmt::format("{}: this kernel has no CAN sockets ({})", interface, std::strerror(errno));
  if (const std::string why = prepare(fd, interface); !why.empty()) {
    (void)close(fd);
    return fmt::format("{}: {}", interface, why);
  }
  const int old = socket_.exchange(fd);
  if (old >= 0) (void)close(old);
  return {};
}

Status SocketCan::reopen() {
  if (socket_.load() >= 0) return Status::kOk;
  return connect().empty() ? Status::kOk : Status::kIo;
}

Status SocketCan::lose(int error) noexcept {
  if (state_ != CanState::kDetached) ++counters_.detached;
  state_ = CanState::kDetached;
  // Down: the same socket works again once the interface is up. Removed: it never will.
  if (error == ENXIO || error == ENODEV) {
    const int fd = socket_.exchange(-1);
    if (fd >= 0) (void)close(fd);
  }
  return Status::kIo;
}

Status SocketCan::send(std::span<const CanFrame> transfer) noexcept {
  if (!valid(transfer)) return Status::kInvalidArgument;
  const int fd = socket_.load();
  if (fd < 0) return Status::kIo;
  if (state_ == CanState::kBusOff || !has_room(fd, transfer.size())) {
    counters_.refused += transfer.size();
    return Status::kNotReady;
  }
  for (std::size_t i = 0; i < transfer.size(); ++i) {
    can_frame out{};
    out.can_id = transfer[i].id | CAN_EFF_FLAG;
    out.can_dlc = transfer[i].size;
    std::ranges::copy(transfer[i].bytes(), std::begin(out.data));
    if (write(fd, &out, sizeof(out)) != sizeof(out)) {
      const int error = errno;
      counters_.refused += transfer.size() - i;
      return error == ENOBUFS || error == EAGAIN || error == EINTR ? Status::kNotReady : lose(error);
    }
    ++counters_.sent;
  }
  if (state_ == CanState::kDetached) state_ = CanState::kActive;
  return Status::kOk;
}

void SocketCan::note(const CanErrorReport& report) noexcept {
  counters_.no_acknowledge += report.no_acknowledge ? 1U : 0U;
  if (report.bus_off) {
    ++counters_.bus_off;
    state_ = CanState::kBusOff;
  } else if (report.restarted || (report.active && state_ != CanState::kBusOff)) {
    state_ = CanState::kActive;
  } else if (report.passive && state_ == CanState::kActive) {
    ++counters_.error_passive;
    state_ = CanState::kPassive;
  }
}

Status SocketCan::receive(CanFrame& frame) noexcept {
  const int fd = socket_.load();
  if (fd < 0) return Status::kIo;
  for (int i = 0; i < kMostErrorFrames; ++i) {
    can_frame in{};
    iovec part{&in, sizeof(in)};
    alignas(cmsghdr) std::array<char, 128> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t got = recvmsg(fd, &message, MSG_DONTWAIT);
    if (got < 0) {
      const int error = errno;
      return error == EAGAIN || error == EINTR ? Status::kNotReady : lose(error);
    }
    if (got != sizeof(in)) continue;
    const Nanos now = read_clock(CLOCK_MONOTONIC) - epoch_;
    Nanos age{0};
    for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
      if (c->cmsg_level != SOL_SOCKET) continue;
      if (c->cmsg_type == SO_TIMESTAMPNS) {
        timespec t{};
        std::memcpy(&t, CMSG_DATA(c), sizeof(t));
        age = read_clock(CLOCK_REALTIME) - Nanos{std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec};
      } else if (c->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t overflow = 0;
        std::memcpy(&overflow, CMSG_DATA(c), sizeof(overflow));
        // A new socket counts from zero again.
        counters_.lost_on_receive += overflow >= overflow_seen_ ? overflow - overflow_seen_ : overflow;
        overflow_seen_ = overflow;
      }
    }
    if ((in.can_id & CAN_ERR_FLAG) != 0) {
      note(classify_error(in));
      continue;
    }
    if (state_ == CanState::kDetached) state_ = CanState::kActive;
    frame.id = in.can_id & CAN_EFF_MASK;
    frame.size = std::min<std::uint8_t>(in.can_dlc, CAN_MAX_DLEN);
    std::copy_n(std::begin(in.data), CAN_MAX_DLEN, frame.data.begin());
    frame.stamp = MonotonicTime{now - std::clamp(age, Nanos{0}, kOldestStamp)};
    ++counters_.received;
    return Status::kOk;
  }
  return Status::kNotReady;
}

}  // namespace roborun::can
