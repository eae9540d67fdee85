/// The one door to the actuators: every frame that leaves, leaves through here.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "firmware_if/assert.hpp"
#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/transfer.hpp"
#include "firmware_if/kill_switch.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"

namespace roborun::firmware_if {

/// What may leave: one row a type. Everything else is refused.
struct TransmitRule {
  dronecan::DataType type{};
  std::uint8_t priority{};    ///< Exactly this one. 0 wins arbitration.
  Nanos shortest_interval{};  ///< Between two of them.
};

inline constexpr std::array<TransmitRule, 7> kTransmitRules{{
    {dronecan::kType<dronecan::EscRawCommand>, 4, Nanos{2'000'000}},  // 400 Hz with a fifth of jitter
    {dronecan::kType<dronecan::ArmingStatus>, 16, Nanos{50'000'000}},
    {dronecan::kType<dronecan::HardpointCommand>, 16, Nanos{50'000'000}},
    {dronecan::kType<dronecan::LightsCommand>, 24, Nanos{50'000'000}},
    {dronecan::kType<dronecan::NodeStatus>, 24, Nanos{500'000'000}},
    {dronecan::kType<dronecan::GetNodeInfoResponse>, 24, Nanos{100'000'000}},  // 55 frames: 8 % of 1 Mbit/s
    {dronecan::kType<dronecan::Allocation>, 30, Nanos{100'000'000}},
}};

/// What the gate does with a throttle, whoever asks for it:
///   - zero, unless armed, not killed and the last beat() is at most `beat_timeout` old;
///   - one for each ESC, no fewer and no more: any other length is refused;
///   - between 0 and `throttle_max`; never reverse;
///   - rising at most `rise_per_s`; falling at once.
/// A package release (hardpoint command 0) leaves only while release_allowed, and never once killed.
/// Transfer ids are counted here, so that no caller can repeat one. Not thread-safe: one lane owns it.
/// RT-safe: O(1), no allocation, does not block.
class TransmitGate {
 public:
  struct Config {
    std::uint8_t esc_count{4};           ///< 1 .. 20.
    std::int16_t throttle_max{8191};     ///< 0 .. 8191: the range of the message.
    std::int32_t rise_per_s{8191 * 40};  ///< Full range in 25 ms: faster than a motor follows (40 ms lag).
    Nanos beat_timeout{7'500'000};       ///< Three control periods at 400 Hz.
    [[nodiscard]] constexpr Status validate() const noexcept {
      const bool good = esc_count >= 1 && esc_count <= 20 && throttle_max >= 0 && throttle_max <= 8191 &&
                        rise_per_s > 0 && beat_timeout.count() > 0;
      return good ? Status::kOk : Status::kInvalidArgument;
    }
  };
  struct Counters {
    std::uint64_t sent{};     ///< Transfers.
    std::uint64_t refused{};  ///< Not on the list, or of the wrong form.
    std::uint64_t too_soon{};
    std::uint64_t no_room{};  ///< The bus did not take it: dropped, never sent later.
    std::uint64_t zeroed{};   ///< Throttles asked for that left as zero because it was not safe.
    std::uint64_t limited{};  ///< Throttles clamped or slowed.
  };

  /// Precondition, asserted: config.validate() is kOk.
  TransmitGate(const Config& config, CanBus& bus) noexcept : config_(config), bus_(bus) {
    ROBORUN_ASSERT(config.validate() == Status::kOk);
  }

  /// Our own node id; 0: none yet, only allocation requests leave.
  void set_node_id(std::uint8_t node_id) noexcept { node_id_ = node_id; }
  [[nodiscard]] std::uint8_t node_id() const noexcept { return node_id_; }
  /// Arms a vehicle that has a kill switch. kNotReady: the switch is not proven, or it is not on "run".
  /// kInvalidArgument: killed.
  [[nodiscard]] Status arm(const KillSwitch& kill_switch) noexcept;
  /// Arms without the proof that a kill switch works: simulation, and motors without propellers.
  /// kInvalidArgument: killed.
  [[nodiscard]] Status arm_unproven() noexcept;
  void disarm() noexcept { armed_ = false; }
  /// Disarms, and stays until reset_kill().
  void kill() noexcept;
  /// Forgets the kill; the vehicle stays disarmed. kNotReady: the switch is still killed, or not on "run".
  [[nodiscard]] Status reset_kill(const KillSwitch& kill_switch) noexcept;
  void allow_release(bool allowed) noexcept { release_allowed_ = allowed; }
  /// The checked control cycle is alive. Nothing else may call this.
  void beat(MonotonicTime now) noexcept;
  /// Whether a throttle other than zero can leave now.
  [[nodiscard]] bool live(MonotonicTime now) const noexcept;

  /// Sends one transfer. The source is node_id(), the transfer id is counted here (of a response: as given).
  /// kOk: it is the driver's now. kInvalidArgument: not on the list (kind, type, priority, destination), or
  /// not of that type's form. kNotReady: sooner than its interval, or no room. kIo: the bus is gone.
  [[nodiscard]] Status send(const dronecan::TransferHeader& header, std::span<const std::uint8_t> payload,
                            MonotonicTime now) noexcept;

  /// The same for a message, with the priority of its rule.
  template <typename T>
  [[nodiscard]] Status send(const T& message, MonotonicTime now) noexcept {
    std::array<std::uint8_t, dronecan::kMaxPayload_bytes<T>> payload{};
    auto size = dronecan::encode(message, payload);
    if (!size.ok()) return size.status();
    return send({.kind = dronecan::kType<T>.kind,
                 .data_type_id = dronecan::kType<T>.id,
                 .priority = priority_of(dronecan::kType<T>)},
                std::span<const std::uint8_t>(payload).first(size.value()), now);
  }

  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  /// A payload on its way out. Throttles are encoded anew, so `payload` then refers to `throttle_payload`.
  struct Outgoing {
    std::span<const std::uint8_t> payload;
    dronecan::EscRawCommand throttles;
    std::array<std::uint8_t, dronecan::kMaxPayload_bytes<dronecan::EscRawCommand>> throttle_payload;
  };

  [[nodiscard]] static std::uint8_t priority_of(const dronecan::DataType& type) noexcept;
  /// The rule by which this transfer may leave; nullptr if there is none.
  [[nodiscard]] const TransmitRule* rule_for(const dronecan::TransferHeader& header,
                                             std::size_t payload_bytes) const noexcept;
  /// Replaces throttles by safe ones, and refuses a release that is not allowed.
  [[nodiscard]] Status make_safe(const TransmitRule& rule, MonotonicTime now, Outgoing& out) noexcept;
  [[nodiscard]] Status refuse(Status why) noexcept;
  [[nodiscard]] Status make_throttles_safe(std::span<const std::uint8_t> payload, MonotonicTime now,
                                           dronecan::EscRawCommand& safe) noexcept;

  Config config_;
  CanBus& bus_;
  std::uint8_t node_id_{0};
  bool armed_{false};
  bool killed_{false};
  bool release_allowed_{false};
  bool beaten_{false};
  MonotonicTime beat_{};
  struct RuleState {
    bool used{false};
    MonotonicTime last{};
    std::uint8_t transfer_id{0};
  };
  std::array<RuleState, kTransmitRules.size()> states_{};
  std::array<std::int16_t, 20> throttle_{};
  std::array<CanFrame, CanBus::kMostFrames> frames_{};
  Counters counters_{};
};

}  // namespace roborun::firmware_if
