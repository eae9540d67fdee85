/// MAVLink 2 message signing. Source: MAVLink developer guide, "Message signing".
///
/// The block behind a signed frame: link id, time stamp (48 bits, low byte first), and the first 48 bits of
/// SHA-256(key, frame from its start byte to its checksum, link id, time stamp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace roborun::firmware_if::mavlink {

inline constexpr std::size_t kSignatureBlock_bytes = 13;
inline constexpr std::size_t kKey_bytes = 32;
using SigningKey = std::array<std::uint8_t, kKey_bytes>;

/// Zeros, also where the compiler sees that nobody reads them.
template <typename Bytes>
void wipe(Bytes& bytes) noexcept {
  for (auto& byte : bytes) {
    volatile auto* const seen = &byte;
    *seen = 0;
  }
}

/// A copy of a key that leaves nothing of it in memory.
class SecretKey {
 public:
  explicit SecretKey(const SigningKey& key) noexcept : key_(key) {}
  SecretKey(const SecretKey&) = default;
  SecretKey& operator=(const SecretKey&) = default;
  ~SecretKey() { wipe(key_); }
  [[nodiscard]] const SigningKey& bytes() const noexcept { return key_; }

 private:
  SigningKey key_;
};

/// Time of signatures: units of 10 us since 2015-01-01 00:00 UTC, 48 bits. Not a clock of the flight loop: it
/// only ever tells old from new.
using SigningTime = std::uint64_t;
inline constexpr SigningTime kMostSigningTime = (SigningTime{1} << 48U) - 1U;
/// A sender not heard before may be this far behind us, not farther: one minute.
inline constexpr SigningTime kMostBehind = 6'000'000;
/// For a Unix time in microseconds; before 2015: 0.
[[nodiscard]] constexpr SigningTime signing_time(std::int64_t unix_us) noexcept {
  constexpr std::int64_t kEpoch_us = 1'420'070'400'000'000;
  return unix_us <= kEpoch_us ? 0 : static_cast<SigningTime>((unix_us - kEpoch_us) / 10) & kMostSigningTime;
}

/// Signs what one link sends. Two links of one (system, component) need two link ids.
class Signer {
 public:
  /// `clock`: the first signature's time stamp is at least this.
  Signer(const SigningKey& key, std::uint8_t link_id, SigningTime clock) noexcept
      : key_(key), link_id_(link_id), next_(clock) {}

  /// Raises the clock; a time behind it changes nothing. For the time that has passed, for what was stored
  /// before a restart, and for Verifier::clock(): an autopilot may live ahead of us.
  void advance_clock(SigningTime clock) noexcept { next_ = clock > next_ ? clock : next_; }
  /// The time stamp of the next signature. Rises by at least one with each.
  [[nodiscard]] SigningTime clock() const noexcept { return next_; }
  /// Writes the block for `frame` (start byte to checksum). RT-safe: O(frame).
  void sign(std::span<const std::uint8_t> frame,
            std::span<std::uint8_t, kSignatureBlock_bytes> block) noexcept;

 private:
  SecretKey key_;
  std::uint8_t link_id_;
  SigningTime next_;
};

enum class SignatureVerdict : std::uint8_t {
  kGood,
  kWrong,     ///< Not made with our key over these bytes.
  kReplayed,  ///< Right, but the time stamp does not rise within its stream.
  kTooOld,    ///< Right, the first of its stream, and more than a minute behind our clock.
  kNoRoom,    ///< Right, but the table of streams is full.
};

/// Checks what comes in. A stream is (system, component, link id); each must rise strictly. No frame changes
/// anything before its hash was found right: else one forged frame would lock its victim out.
/// RT-safe: O(frame + streams), no allocation; one thread.
class Verifier {
 public:
  /// What is remembered of one stream. Opaque: only its size matters to the owner.
  struct Stream {
    bool used{false};
    std::uint8_t sysid{};
    std::uint8_t compid{};
    std::uint8_t link_id{};
    SigningTime last{};
  };

  /// `streams` must outlive this: one for each sender and link that may be heard. Only holders of the key can
  /// fill it.
  Verifier(const SigningKey& key, std::span<Stream> streams, SigningTime clock) noexcept
      : key_(key), streams_(streams), clock_(clock) {}

  /// `frame`: start byte to checksum.
  [[nodiscard]] SignatureVerdict check(std::uint8_t sysid, std::uint8_t compid,
                                       std::span<const std::uint8_t> frame,
                                       std::span<const std::uint8_t, kSignatureBlock_bytes> block) noexcept;
  /// As of Signer.
  void advance_clock(SigningTime clock) noexcept { clock_ = clock > clock_ ? clock : clock_; }
  /// The newest of what was told and what was heard in good frames.
  [[nodiscard]] SigningTime clock() const noexcept { return clock_; }

 private:
  SecretKey key_;
  std::span<Stream> streams_;
  SigningTime clock_;
};

}  // namespace roborun::firmware_if::mavlink
