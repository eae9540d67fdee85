/// A flight, flown again on the inputs in its log.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "platform/log/log_records.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/mission/inputs_format.hpp"
#include "platform/mission/keyframes.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/recording.hpp"

namespace roborun::mission {

/// Reads the inputs in a log, record by record. Whatever is wrong with the file becomes one line.
class Recording {
 public:
  /// Reads the configuration. Throws InputError, also for a log that holds no inputs.
  explicit Recording(const std::string& path);

  [[nodiscard]] const RecordedFlight& flight() const noexcept { return flight_; }
  [[nodiscard]] RecordKind kind() const noexcept { return kind_; }
  [[nodiscard]] std::string_view payload() const noexcept { return payload_; }
  /// Of the record at hand.
  [[nodiscard]] InputsPosition position() const noexcept;
  /// On to a record behind the one at hand. False: the log has another one there, or it cannot be read; nothing may follow.
  [[nodiscard]] bool skip_to(const InputsPosition& position);
  /// The configuration, as text.
  [[nodiscard]] const std::string& configuration() const noexcept { return configuration_; }
  /// On to the next record. At the end and where the file is cut or damaged nothing follows: kind() is kEnd.
  void next();
  /// The whole log was read, and it is whole. Only at the end.
  [[nodiscard]] bool is_whole() const noexcept { return damage_.empty(); }
  /// Empty, or what is wrong with the file, and where.
  [[nodiscard]] const std::string& damage() const noexcept { return damage_; }
  /// Of the flight. Only at the end of a whole log.
  [[nodiscard]] FlightTotals totals() const noexcept { return totals_; }

 private:
  /// The configuration, once it has come.
  [[nodiscard]] bool read_configuration(const log::Message& message);
  void read_message();
  void break_off(const std::string& why);
  void end();

  std::string path_;
  log::McapReader reader_;
  std::string configuration_;
  std::uint32_t sequence_{0};  ///< Of the next message of inputs.
  std::uint64_t chunk_at_{0};  ///< Where the chunk of the one at hand begins.
  std::uint32_t crc_{0};       ///< Of its bytes.
  InputRecords inputs_;
  std::size_t at_{0};  ///< The next one of them.
  RecordKind kind_{RecordKind::kGiveUp};
  std::string_view payload_;
  FlightTotals totals_;
  std::string damage_;
  RecordedFlight flight_;
};

/// Where a replay first does something else than the flight did.
struct ReplayDifference {
  std::uint64_t minor_frame{};  ///< From 1.
  double time_s{};
  std::string stage;  ///< "inputs", "track", or one of a decision.
  std::string what;   ///< "motor 2", "p0_level", ...
  std::string recorded, replayed;
};

struct ReplayResult {
  FlightTotals recorded;  ///< Of a whole log that was replayed to its end; else as `replayed`.
  FlightTotals replayed;
  double seconds{};     ///< Replayed.
  double keyframe_s{};  ///< Until here it was replayed before: nothing of it was compared again.
  std::string damage;   ///< Empty, or where the log ends early: it was replayed so far.
  std::optional<ReplayDifference> difference;
  [[nodiscard]] bool same() const noexcept { return !difference && recorded == replayed; }
};

/// Nobody asks for what is before `from_s`: a replay may begin with a keyframe before it, and leaves keyframes for the next.
struct ReplayStart {
  double from_s{0.0};
  std::string keyframes{};      ///< The folder; empty: none, replay from the beginning.
  Nanos every{10'000'000'000};  ///< A keyframe: replayed in a fifth of a second, two megabytes.
};

/// Flies on recorded inputs alone, through the same executive, programs and stages, and compares every motor command and
/// decision; of a whole log the map in the end, too. Throws InputError for a file that is no log, or has no inputs. `until_s`: no
/// minor frame after it. `start`: where it may begin. `progress` (may be empty) gets the seconds done, once a second of flight; `decided` (the same) each
/// decision that is the recorded one, as it stands in a log.
[[nodiscard]] ReplayResult replay_flight(const std::string& path, const std::function<void(double)>& progress,
                                         double until_s = std::numeric_limits<double>::infinity(),
                                         const std::function<void(const log::DecisionEntry&)>& decided = {},
                                         const ReplayStart& start = {});

}  // namespace roborun::mission
