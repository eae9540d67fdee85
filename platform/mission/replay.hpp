/// A recorded flight, flown again on its own inputs.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "platform/input/input_file.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/recording.hpp"

namespace roborun::mission {

/// Reads a recording, record by record. Whatever is wrong with the file becomes one line.
class Recording {
 public:
  /// Reads the configuration. Throws InputError.
  explicit Recording(const std::string& path);

  [[nodiscard]] const RecordedFlight& flight() const noexcept { return flight_; }
  [[nodiscard]] RecordKind kind() const noexcept { return kind_; }
  [[nodiscard]] std::span<const std::byte> payload() const noexcept { return payload_; }
  /// On to the next record. At the end and in a broken file nothing follows: kind() is kEnd.
  void next() noexcept;
  /// Empty, or what is wrong with the file and where.
  [[nodiscard]] const std::string& error() const noexcept { return error_; }
  /// Of the recorded flight. Only at the end.
  [[nodiscard]] FlightTotals totals() const noexcept;

 private:
  void read_record() noexcept;
  /// Throws InputError if the file cannot be read.
  void try_to_read_record();
  void break_off(const std::string& why);

  std::string path_;
  input::InputFile file_;
  std::uint64_t position_{0};
  std::uint64_t checksum_{0};
  RecordKind kind_{};
  std::vector<std::byte> payload_;
  std::string error_;
  RecordedFlight flight_;
};

struct ReplayResult {
  FlightTotals recorded, replayed;
  double seconds{};  ///< Of the flight.
  /// Of the replayed flight: the minor frame in which it first wanted other inputs than the recorded one.
  std::uint64_t diverged_in{};
  [[nodiscard]] bool same() const noexcept { return diverged_in == 0 && recorded == replayed; }
};

/// Flies on recorded inputs alone, through the same executive, programs and stages. Throws InputError
/// for a file that is no recording, is cut off or was changed. `progress` (may be empty) gets the seconds
/// done, once a second of flight.
[[nodiscard]] ReplayResult replay_flight(const std::string& path,
                                         const std::function<void(double)>& progress);

}  // namespace roborun::mission
