/// Keyframes of replays on disk: the state of a flight at some moments of its log, as a replay by this program has found it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace roborun::mission {

/// A record of the inputs in a log.
struct InputsPosition {
  std::uint64_t chunk_at{};  ///< Byte where the chunk of its message begins.
  std::uint32_t sequence{};  ///< Of its message ...
  std::uint32_t crc{};       ///< ... and that of the message's bytes.
  std::uint32_t record{};    ///< Which one in its message.
};

struct Keyframe {
  std::uint64_t frames{};  ///< Minor frames before it.
  InputsPosition position{};
  std::string changes;  ///< FlightMemory::changes().
};

/// A keyframe is an image of memory, so it is of use to the very program that wrote it alone, and no file that comes from elsewhere
/// may be taken for one: the folder is the user's own.
class Keyframes {
 public:
  /// Of this log's flight, by this program; `folder` is made when the first keyframe is kept. Empty: none are there or kept.
  Keyframes(std::string folder, std::string_view configuration);
  /// The latest one of fewer frames than that; none if there is none, or its file is damaged.
  [[nodiscard]] std::optional<Keyframe> before(std::uint64_t frames) const;
  [[nodiscard]] bool has(std::uint64_t frames) const;
  /// Writes it, and removes the oldest files beyond kMost_bytes. What cannot be written is not there: no error.
  void keep(const Keyframe& keyframe) const noexcept;
  [[nodiscard]] bool are_kept() const noexcept { return !prefix_.empty(); }

  static constexpr std::uint64_t kMost_bytes = 512'000'000;

 private:
  [[nodiscard]] std::string path_of(std::uint64_t frames) const;

  std::string folder_;
  std::string prefix_;  ///< Of the names of this flight's files.
};

}  // namespace roborun::mission
