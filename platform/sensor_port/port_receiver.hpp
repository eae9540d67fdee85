/// Ports that another machine's PortSender fills.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "firmware_if/time.hpp"
#include "platform/sensor_port/port_datagram.hpp"
#include "platform/sensor_port/port_sender.hpp"
#include "platform/sensor_port/port_writer.hpp"

namespace roborun::sensor_port {

/// Samples are written in their order and once each, pictures whole or not at all. Lengths, counts and numbers of datagrams are not believed. One thread.
class PortReceiver {
 public:
  struct Counters {
    std::uint64_t samples{}, pictures{};  ///< Written.
    std::uint64_t lost{};     ///< Samples that never came, and pictures of which a piece never came.
    std::uint64_t late{};     ///< Pictures that came after a newer one had begun.
    std::uint64_t refused{};  ///< Datagrams that contradict themselves, or what was announced.
  };
  /// A port takes no more memory than this: a datagram asks for it.
  static constexpr std::uint64_t kMostFile_bytes = 64U << 20U;

  PortReceiver(const std::string& name, PortFilter takes) : name_(name), takes_(takes) {}
  /// Makes what is not there yet: entries of a hello. Throws InputError where another process writes one of these ports.
  void announced(std::span<const std::uint8_t> streams, std::size_t count);
  /// `shift`: from the other machine's clock to this one's.
  void samples(std::span<const std::uint8_t> message, std::size_t count, Nanos shift);
  void piece(MonotonicTime now, std::span<const std::uint8_t> message, Nanos shift);
  /// Asks for what is missing of the newest pictures.
  void ask(MonotonicTime now, std::uint32_t session, const SendDatagram& send);
  /// Another sender: its numbers begin anew.
  void forget() noexcept;
  [[nodiscard]] std::size_t ports() const noexcept { return streams_.size(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Stream {
    BridgeStream told;
    PortWriter port;
    bool is_known{false};         ///< By the sender of now.
    std::uint64_t number{0};      ///< Of the next sample; of the picture that is coming.
    std::int64_t stamp_ns{};      ///< Of the newest sample.
    std::vector<std::byte> held;  ///< The picture that is coming.
    std::vector<bool> has;        ///< Which pieces of it.
    std::size_t missing{0};
    MonotonicTime heard{}, asked{};
  };
  void open(Stream& stream, const BridgeStream& told);
  void refuse() noexcept { ++counters_.refused; }
  /// Null: nothing of it was announced yet, or it is of the other form.
  [[nodiscard]] Stream* find(std::uint32_t stream, std::uint32_t generation, bool pictures);
  void begin(Stream& stream, const BridgePiece& piece);
  void write(Stream& stream, std::span<std::byte> sample, std::span<const std::byte> payload, Nanos shift);

  std::string name_;
  PortFilter takes_;
  std::vector<std::unique_ptr<Stream>> streams_;
  Counters counters_{};
};

}  // namespace roborun::sensor_port
