/// What the two ends of a PortBridge say to each other: one datagram each, in the byte order of both (little-endian).
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <type_traits>

namespace roborun::sensor_port {

static_assert(std::endian::native == std::endian::little,
              "ports and their datagrams are of little-endian machines");

inline constexpr std::size_t kDatagram_bytes = 1400;  ///< Fits a frame of Ethernet, behind its tunnels too.
inline constexpr std::array<char, 4> kBridgeMagic{'r', 'r', 'P', 'B'};
inline constexpr std::uint8_t kBridgeVersion = 1;
inline constexpr std::size_t kMostStreams = 24;

enum class BridgeMessage : std::uint8_t {
  kHello = 1,    ///< BridgeHello, then `count` BridgeStream: what this end sends. Every 100 ms.
  kTime = 2,     ///< BridgeTime: the answer to a hello that asks.
  kSamples = 3,  ///< BridgeSamples, then `count` samples, each whole.
  kPiece = 4,    ///< BridgePiece, then bytes of a picture: its sample and its payload.
  kAgain = 5     ///< BridgeAgain, then `count` BridgeGap.
};

/// Before everything.
struct BridgeHeader {
  std::array<char, 4> magic{kBridgeMagic};
  std::uint8_t version{kBridgeVersion};
  BridgeMessage message{};
  std::uint16_t count{};
  std::uint32_t session{};  ///< Of the sender: another one with each start.
  std::uint32_t reserved{};
};
struct BridgeHello {
  std::int64_t asked_ns{};  ///< The sender's clock; 0: it does not ask for the other one's.
};
struct BridgeStream {
  std::array<char, 24> suffix{};  ///< Of the port's name: "imu", "camera1"; zeros behind it.
  std::uint32_t kind{};           ///< enum roborun_port_kind
  std::uint32_t slots{};
  std::uint32_t payload_room_bytes{};
  std::uint32_t generation{};  ///< Grows when another file takes the port's place: numbers begin anew.
};
struct BridgeTime {
  std::int64_t asked_ns{}, mine_ns{};
};
/// `stream`: its place in the sender's hello. `number`: of the first sample, or of the picture.
struct BridgeSamples {
  std::uint32_t stream{}, generation{};
  std::uint64_t number{};
};
struct BridgePiece {
  std::uint32_t stream{}, generation{};
  std::uint64_t number{};
  std::uint32_t picture_bytes{};
  std::uint32_t index{};
};
struct BridgeAgain {
  std::uint32_t stream{}, generation{};
  std::uint64_t number{};
};
/// Pieces that are missing.
struct BridgeGap {
  std::uint16_t first{}, count{};
};
static_assert(sizeof(BridgeHeader) == 16 && sizeof(BridgeStream) == 40 && sizeof(BridgeSamples) == 16);
static_assert(sizeof(BridgePiece) == 24 && sizeof(BridgeAgain) == 16 && sizeof(BridgeGap) == 4);
static_assert(sizeof(BridgeHeader) + sizeof(BridgeHello) + kMostStreams * sizeof(BridgeStream) <=
              kDatagram_bytes);

/// Bytes of a picture in each piece but the last.
inline constexpr std::size_t kPiece_bytes = 1344;
static_assert(sizeof(BridgeHeader) + sizeof(BridgePiece) + kPiece_bytes <= kDatagram_bytes);
/// How many pieces a picture of so many bytes has.
[[nodiscard]] constexpr std::size_t pieces_of(std::size_t bytes) noexcept {
  return (bytes + kPiece_bytes - 1) / kPiece_bytes;
}

/// A stamp on another clock. What a writer says may be anything: it wraps around.
[[nodiscard]] constexpr std::int64_t moved_ns(std::int64_t stamp_ns, std::int64_t by_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(stamp_ns) + static_cast<std::uint64_t>(by_ns));
}

using SendDatagram = std::function<void(std::span<const std::uint8_t>)>;

/// One that is being written.
class Datagram {
 public:
  Datagram(BridgeMessage message, std::uint32_t session) {
    BridgeHeader header;
    header.message = message;
    header.session = session;
    put(header);
  }
  template <typename T>
  void put(const T& value) noexcept {
    static_assert(std::is_trivially_copyable_v<T>);
    put_bytes(std::as_bytes(std::span(&value, 1)));
  }
  /// Precondition: there is room.
  void put_bytes(std::span<const std::byte> bytes) noexcept {
    std::memcpy(bytes_.data() + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }
  [[nodiscard]] std::size_t room_bytes() const noexcept { return bytes_.size() - size_; }
  /// With so many entries behind its message.
  void send(std::size_t count, const SendDatagram& send) noexcept {
    const auto entries = static_cast<std::uint16_t>(count);
    std::memcpy(bytes_.data() + offsetof(BridgeHeader, count), &entries, sizeof entries);
    send(std::span<const std::uint8_t>(bytes_).first(size_));
  }

 private:
  std::array<std::uint8_t, kDatagram_bytes> bytes_{};
  std::size_t size_{0};
};

/// Takes the next value off the front. False: there is too little left.
template <typename T>
[[nodiscard]] bool take(std::span<const std::uint8_t>& bytes, T& out) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  if (bytes.size() < sizeof out) return false;
  std::memcpy(&out, bytes.data(), sizeof out);
  bytes = bytes.subspan(sizeof out);
  return true;
}

}  // namespace roborun::sensor_port
