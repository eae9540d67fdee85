#include "firmware_if/mavlink/signing.hpp"

#include <algorithm>

#include "firmware_if/sha256.hpp"

namespace roborun::firmware_if::mavlink {
namespace {

constexpr std::size_t kLinkAndTime_bytes = 7;
constexpr std::size_t kHash_bytes = kSignatureBlock_bytes - kLinkAndTime_bytes;

std::array<std::uint8_t, kHash_bytes> hash(const SigningKey& key, std::span<const std::uint8_t> frame,
                                           std::span<const std::uint8_t> link_and_time) noexcept {
  Sha256 sha;
  sha.add(key);
  sha.add(frame);
  sha.add(link_and_time);
  const Sha256::Digest digest = sha.finish();
  std::array<std::uint8_t, kHash_bytes> first{};
  std::copy_n(digest.begin(), first.size(), first.begin());
  return first;
}

}  // namespace

void Signer::sign(std::span<const std::uint8_t> frame,
                  std::span<std::uint8_t, kSignatureBlock_bytes> block) noexcept {
  block[0] = link_id_;
  for (std::size_t i = 0; i < 6; ++i) block[1 + i] = static_cast<std::uint8_t>(next_ >> (8U * i));
  const auto first = hash(key_.bytes(), frame, block.first<kLinkAndTime_bytes>());
  std::copy(first.begin(), first.end(), block.begin() + kLinkAndTime_bytes);
  ++next_;
}

SignatureVerdict Verifier::check(std::uint8_t sysid, std::uint8_t compid, std::span<const std::uint8_t> frame,
                                 std::span<const std::uint8_t, kSignatureBlock_bytes> block) noexcept {
  const auto wanted = hash(key_.bytes(), frame, block.first<kLinkAndTime_bytes>());
  unsigned difference = 0;  // all bytes, so that the time taken tells nothing of them
  for (std::size_t i = 0; i < wanted.size(); ++i)
    difference |= static_cast<unsigned>(wanted[i] ^ block[kLinkAndTime_bytes + i]);
  if (difference != 0) return SignatureVerdict::kWrong;

  SigningTime stamp = 0;
  for (std::size_t i = 0; i < 6; ++i) stamp |= static_cast<SigningTime>(block[1 + i]) << (8U * i);
  const auto is_this = [&](const Stream& s) {
    return s.used && s.sysid == sysid && s.compid == compid && s.link_id == block[0];
  };
  auto stream = std::find_if(streams_.begin(), streams_.end(), is_this);
  if (stream != streams_.end()) {
    if (stamp <= stream->last) return SignatureVerdict::kReplayed;
  } else {
    if (stamp + kMostBehind < clock_) return SignatureVerdict::kTooOld;
    stream = std::find_if(streams_.begin(), streams_.end(), [](const Stream& s) { return !s.used; });
    if (stream == streams_.end()) return SignatureVerdict::kNoRoom;
    *stream = {.used = true, .sysid = sysid, .compid = compid, .link_id = block[0], .last = 0};
  }
  stream->last = stamp;
  advance_clock(stamp);
  return SignatureVerdict::kGood;
}

}  // namespace roborun::firmware_if::mavlink
