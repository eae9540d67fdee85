/// The ports of one machine as datagrams for another one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "firmware_if/time.hpp"
#include "platform/sensor_port/port_datagram.hpp"
#include "platform/sensor_port/port_reader.hpp"

namespace roborun::sensor_port {

/// Which ports, by the end of their names: "imu" of NAME-imu.
using PortFilter = bool (*)(std::string_view suffix);

/// Samples without a payload (IMU, bus, lines ...) leave at once, and each datagram repeats as many of those before as it has room for: what one lost
/// datagram held comes with the next. Pictures (images, clouds) leave in pieces, whole ones only, the newest there is; the pieces of the last one
/// are sent again when they are asked for. One thread.
class PortSender {
 public:
  struct Counters {
    std::uint64_t samples{}, pictures{}, pieces{},
        repeated{};  ///< Pieces, and those that were asked for again.
  };

  PortSender(const std::string& name, PortFilter sends, std::uint32_t session);
  /// Which ports there are now. Opens files. Not for each step.
  void look();
  /// Tells what is sent; `asked_ns` as in BridgeHello.
  void announce(std::int64_t asked_ns, const SendDatagram& send) const;
  /// What is new. `shift`: from this machine's clock to that of the other one.
  void step(Nanos shift, const SendDatagram& send);
  void again(const BridgeAgain& which, std::span<const std::uint8_t> gaps, const SendDatagram& send);
  [[nodiscard]] std::size_t ports() const noexcept { return streams_.size(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Stream {
    std::string suffix;
    PortReader reader;
    bool is_open{false};
    std::uint32_t generation{0};
    std::uint64_t number{0};      ///< Samples so far; of a picture its number.
    std::vector<std::byte> held;  ///< The newest samples, or the picture.
    std::size_t fresh{0};         ///< Of them, not sent yet.
    std::size_t next_piece{0};
  };
  void open(Stream& stream);
  void step_samples(std::uint32_t index, Nanos shift, const SendDatagram& send);
  void flush(std::uint32_t index, const SendDatagram& send);
  /// Returns how many pieces of `most` are left.
  std::size_t step_picture(std::uint32_t index, Nanos shift, std::size_t most, const SendDatagram& send);
  void send_piece(std::uint32_t index, std::size_t piece, const SendDatagram& send);

  std::string name_;
  PortFilter sends_;
  std::uint32_t session_;
  std::vector<std::unique_ptr<Stream>> streams_;
  std::size_t turn_{0};  ///< Whose pictures come first.
  Counters counters_{};
};

/// Images and clouds: their samples have a payload, and the newest counts.
[[nodiscard]] bool is_picture(std::uint32_t kind) noexcept;
/// Letters, digits and dashes, at most 23 of them.
[[nodiscard]] bool is_suffix(std::string_view suffix) noexcept;

}  // namespace roborun::sensor_port
