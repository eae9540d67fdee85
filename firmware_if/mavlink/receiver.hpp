/// MAVLink frames out of a stream of bytes that may hold anything. Source: MAVLink developer guide, "Packet
/// serialization", "MAVLink 2", "Message signing".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware_if/mavlink/frame.hpp"
#include "firmware_if/mavlink/signing.hpp"

namespace roborun::firmware_if::mavlink {

/// What next() met.
enum class Event : std::uint8_t {
  kNothing,       ///< More bytes are needed.
  kFrame,         ///< A frame to act upon.
  kUnknownId,     ///< A message that we do not know; stepped over whole, unchecked.
  kBadFlags,      ///< An unknown incompatibility flag; the search goes on behind the start byte.
  kBadCrc,        ///< Damaged, or no frame at all; the search goes on behind the start byte.
  kCut,           ///< Given up as unfinished (give_up()); the search goes on behind the start byte.
  kUnsigned,      ///< Whole, but a signature is demanded.
  kBadSignature,  ///< Whole, but not signed with our key.
  kReplayed,      ///< Signed with our key, but not new.
  kNoRoom,        ///< Signed with our key, but one sender too many for the verifier.
};
inline constexpr std::size_t kEventCount = 10;
[[nodiscard]] const char* to_string(Event event) noexcept;

/// Both versions mixed. After a failed start byte the search goes on right behind it, so that a damaged frame
/// or a stray start byte costs no good frame behind it; only an unknown id is believed in its length, since
/// nothing can be checked in it.
///
///     while (!bytes.empty()) {
///       bytes = bytes.subspan(receiver.push(bytes));
///       while ((event = receiver.next(frame)) != Event::kNothing) ...
///     }
///
/// With a verifier: only signed, right and new frames are kFrame. Without: signed ones are as good as
/// unsigned ones, and `is_authenticated` is false for all.
/// RT-safe: no allocation; push() is O(bytes), next() O(one frame), and the calls that give an event are at
/// most as many as bytes were pushed. A hostile sender can make every byte a start byte whose checksum has to
/// be computed: a lane bounds its calls of next() per cycle, and what is left waits. One thread.
class Receiver {
 public:
  struct Counters {
    std::array<std::uint64_t, kEventCount> events{};  ///< Indexed by Event; kNothing stays 0.
    std::uint64_t garbage_bytes{};                    ///< Outside of frames and stepped-over ones.
  };

  /// `verifier`: nullptr, or must outlive this.
  explicit Receiver(Verifier* verifier = nullptr) noexcept : verifier_(verifier) {}

  /// Takes bytes, as many as there is room for; the result is how many, at least 1 (of any) once next() has
  /// given kNothing. What was given out of frames is no longer valid.
  [[nodiscard]] std::size_t push(std::span<const std::uint8_t> bytes) noexcept;
  /// `frame` is written with kFrame, and with events of whole frames (kUnknownId, kUnsigned, kBadSignature,
  /// kReplayed, kNoRoom) for the log; valid until the next push().
  [[nodiscard]] Event next(Frame& frame) noexcept;
  /// What is pending will never be completed: its start byte was false, and there may be frames behind it.
  /// For the end of a file, and for a line that was silent for longer than a frame takes. Until push().
  void give_up() noexcept { gave_up_ = true; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  [[nodiscard]] Event judge(Frame& frame) noexcept;
  void skip_garbage() noexcept;
  [[nodiscard]] std::span<const std::uint8_t> pending() const noexcept {
    return std::span<const std::uint8_t>(buffer_).subspan(begin_, end_ - begin_);
  }

  // Twice the longest frame: whole frames are moved to the front only now and then.
  std::array<std::uint8_t, 2 * kMostFrame_bytes> buffer_{};
  std::size_t begin_{0};
  std::size_t end_{0};
  bool gave_up_{false};
  Verifier* verifier_;
  Counters counters_{};
};

}  // namespace roborun::firmware_if::mavlink
