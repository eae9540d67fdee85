/// Our end of a signed link: the key of both directions, read from a file and wiped at the end, and the time of signatures.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "firmware_if/mavlink/signing.hpp"
#include "firmware_if/time.hpp"

namespace roborun::mavlink {

/// 64 hexadecimal digits, in a file: a key on the command line is in the history of the shell. None for an empty path. Throws
/// InputError that names the option and repeats nothing of what was read.
[[nodiscard]] std::optional<firmware_if::mavlink::SecretKey> read_key(const char* option,
                                                                      const std::string& path);

class SignedEnd {
 public:
  /// Two links of one component need two link ids.
  SignedEnd(const firmware_if::mavlink::SecretKey& key, std::uint8_t link_id);
  SignedEnd(const SignedEnd&) = delete;
  SignedEnd& operator=(const SignedEnd&) = delete;

  /// Before anything is sent: the time that has passed, and the other side's, which may live ahead of us. RT-safe: O(1).
  void tick(MonotonicTime now) noexcept;
  [[nodiscard]] firmware_if::mavlink::Signer* signer() noexcept { return &signer_; }
  [[nodiscard]] firmware_if::mavlink::Verifier* verifier() noexcept { return &verifier_; }

 private:
  std::array<firmware_if::mavlink::Verifier::Stream, 16> streams_{};
  firmware_if::mavlink::SigningTime start_;
  std::optional<MonotonicTime> first_;
  firmware_if::mavlink::Signer signer_;
  firmware_if::mavlink::Verifier verifier_;
};

}  // namespace roborun::mavlink
