#include "platform/mavlink/signed_end.hpp"

#include <fmt/format.h>

#include <charconv>
#include <chrono>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"

namespace roborun::mavlink {

namespace mav = firmware_if::mavlink;

namespace {

mav::SigningTime time_now() {
  using std::chrono::microseconds;
  const auto unix_time = std::chrono::system_clock::now().time_since_epoch();
  return mav::signing_time(std::chrono::duration_cast<microseconds>(unix_time).count());
}

}  // namespace

std::optional<mav::SecretKey> read_key(const char* option, const std::string& path) {
  if (path.empty()) return std::nullopt;
  constexpr const char* kWanted = "a file of 64 hexadecimal digits";
  std::string text = input::read_text(path, kWanted, 4096);
  const std::size_t count = text.find_last_not_of(" \t\r\n") + 1;
  mav::SigningKey key{};
  bool good = count == 2 * key.size();
  for (std::size_t i = 0; good && i < key.size(); ++i) {
    const char* at = text.data() + 2 * i;
    good = std::from_chars(at, at + 2, key.at(i), 16).ptr == at + 2;
  }
  const mav::SecretKey secret(key);
  mav::wipe(text);
  mav::wipe(key);
  if (!good) throw InputError(fmt::format("{}: {}: no key: must be {}", option, path, kWanted));
  return secret;
}

SignedEnd::SignedEnd(const mav::SecretKey& key, std::uint8_t link_id)
    : start_(time_now()), signer_(key.bytes(), link_id, start_), verifier_(key.bytes(), streams_, start_) {}

void SignedEnd::tick(MonotonicTime now) noexcept {
  constexpr std::int64_t kUnit_ns = 10'000;
  if (!first_) first_ = now;
  const mav::SigningTime time = start_ + static_cast<mav::SigningTime>((now - *first_).count() / kUnit_ns);
  verifier_.advance_clock(time);
  signer_.advance_clock(verifier_.clock());
}

}  // namespace roborun::mavlink
