/// The log of one flight: its topics (README.md), formatted and written by whoever calls.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "platform/log/log_file.hpp"
#include "platform/log/log_records.hpp"
#include "platform/log/log_viewer.hpp"
#include "platform/log/mcap_writer.hpp"

namespace roborun::log {

enum class Level : std::uint8_t { kInfo = 2, kWarning, kError };  ///< Numbers of foxglove.LogLevel.

/// What was lost before it came here.
struct RingDrops {
  std::uint64_t states{}, decisions{}, slices{};
  bool operator==(const RingDrops&) const = default;
};

/// The message of `/decision`.
[[nodiscard]] std::string decision_json(const DecisionEntry& entry);

/// One thread. Nothing after the constructor throws but std::bad_alloc: a flight goes on without its log, and error() tells.
class FlightLog final : public LogSink {
 public:
  inline static constexpr const char* kInputsTopic = "/inputs";
  inline static constexpr const char* kInputsEncoding = "roborun.inputs";

  /// Throws InputError as LogFile. Path (empty: for show_to() alone) and `synced` as there.
  FlightLog(const std::string& path, bool synced);
  /// As finish().
  ~FlightLog() override;
  FlightLog(const FlightLog&) = delete;
  FlightLog& operator=(const FlightLog&) = delete;

  /// From here on `viewer` gets all messages but inputs; it outlives this.
  void show_to(LogViewer& viewer);
  /// To be called once, first: `json` is the message of `/configuration`, `build` its part of that name.
  void configure(const std::string& json, const StringMap& build);
  /// `json` is the message of `/world`.
  void world(std::string_view json) noexcept;
  void write(const StateRecord& record) noexcept override;
  void write(const FailsafeEntry& entry) noexcept override;
  void write(const DecisionEntry& entry) noexcept override;
  void write(const MapSlice& slice) noexcept override;
  void inputs(std::int64_t time_ns, std::string_view bytes) noexcept;
  void event(std::int64_t time_ns, Level level, std::string_view name, std::string_view text) noexcept;
  /// `json` is the message of `/result`.
  void result(std::int64_t time_ns, std::string_view json) noexcept;
  /// `json` is the message of `/verdict`.
  void verdict(std::int64_t time_ns, std::string_view json) noexcept;
  /// A message if any number has grown.
  void dropped(const RingDrops& drops) noexcept;
  /// The summary. Nothing may follow; more than once is harmless.
  void finish() noexcept;
  /// Empty, or one line: why messages are missing in the file, and how many.
  [[nodiscard]] std::string error() const;
  [[nodiscard]] std::uint64_t bytes() const noexcept { return writer_.bytes(); }

 private:
  void put(std::uint16_t channel, std::int64_t time_ns, std::string_view data);
  void tell_drops();
  void write_pose(const StateRecord& record);
  void write_path(const StateRecord& record);

  LogFile file_;
  McapWriter writer_;
  LogViewer* viewer_{nullptr};
  std::uint16_t configuration_{}, world_{}, state_{}, pose_{}, tf_{}, path_{}, trajectory_{}, decision_{},
      map_{}, failsafe_{}, events_{}, dropped_{}, result_{}, verdict_{}, inputs_{};
  std::int64_t last_ns_{0};
  RingDrops drops_{};
  std::uint64_t told_messages_{0};
  RingDrops told_drops_{};
  bool finished_{false};
  std::uint64_t states_{0};
  std::vector<Numbers3> flown_W_;
  std::uint64_t path_step_{0};  ///< States between two points.
};

}  // namespace roborun::log
