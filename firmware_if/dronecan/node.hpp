/// roborun as a node on a DroneCAN bus: says who and how it is, hears the others, drives the ESCs.
/// Source: UAVCAN v0 specification, "Application level functions".
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware_if/can.hpp"
#include "firmware_if/dronecan/transfer.hpp"
#include "firmware_if/transmit_gate.hpp"

namespace roborun::firmware_if::dronecan {

inline constexpr Nanos kOfflineAfter{3'000'000'000};
inline constexpr std::uint16_t kThrottleFull = 8191;

/// The newest message of a type, and who said it when. count == 0: none yet; it never decreases.
template <typename T>
struct Heard {
  T message{};
  MonotonicTime stamp{};
  std::uint8_t source_node_id{};
  std::uint64_t count{};
};

/// What the motors' side listens to. Sensors are heard by who reads all of their samples (platform/live/bus_sensors).
struct Inbox {
  std::array<Heard<EscStatus>, 20> esc{};  ///< By esc_index.
  Heard<BatteryInfo> battery;
  Heard<HardpointStatus> hardpoint;
};

/// Asks an allocator for a node id, in three stages of at most 6 bytes of the unique id.
/// Waiting times are drawn from the unique id, so that two nodes do not ask in step. RT-safe: O(1).
class AllocationClient {
 public:
  /// @param preferred  Node id asked for, 0: any.
  AllocationClient(const std::array<std::uint8_t, 16>& unique_id, std::uint8_t preferred) noexcept;

  /// What is to be sent now, if anything: true, and `request` is written.
  [[nodiscard]] bool poll(MonotonicTime now, Allocation& request) noexcept;
  /// An Allocation from a node with an id. The node id granted to us, or 0.
  [[nodiscard]] std::uint8_t take(const Allocation& answer, MonotonicTime now) noexcept;

 private:
  [[nodiscard]] Nanos random(Nanos from, Nanos to) noexcept;

  std::array<std::uint8_t, 16> unique_id_;
  std::uint8_t preferred_;
  std::uint8_t confirmed_bytes_{0};  ///< Of our unique id, by the allocator's last answer.
  bool scheduled_{false};
  MonotonicTime next_{};
  std::uint64_t random_state_;
};

/// The node. One lane owns it and calls step() once a control frame.
class Node {
 public:
  struct Config {
    std::uint8_t node_id{10};  ///< 1 .. 127; 0: ask the allocator.
    /// Of this vehicle's computer; all zero is refused with node_id 0.
    std::array<std::uint8_t, 16> unique_id{};
    std::string_view name{"org.roborun"};  ///< At most 80 bytes; must outlive the node.
    std::uint8_t esc_count{4};             ///< As the gate's.
    Nanos command_period{2'500'000};       ///< 2.5 ms .. 20 ms: 50 .. 400 Hz.
    std::uint16_t most_frames_a_step{64};  ///< Bounds a step: 1 Mbit/s brings 19 frames in 2.5 ms.
    [[nodiscard]] constexpr Status validate() const noexcept;
  };
  struct Input {
    bool cycle_ok{};  ///< The control cycle was checked: only then a NodeStatus may leave.
    bool armed{};
    std::span<const double> thrust_ratio{};  ///< One an ESC, 0 .. 1. Anything else: zeros are sent.
    std::uint8_t health{};                   ///< Of NodeStatus.
  };
  struct Counters {
    std::uint64_t frames{};
    std::uint64_t transfers{};
    std::uint64_t not_decoded{};       ///< Transfers that are none of their type.
    std::uint64_t foreign_command{};   ///< RawCommands of somebody else: an alarm.
    std::uint64_t foreign_node_id{};   ///< Frames under our own node id: an alarm.
    std::uint64_t step_full{};         ///< Steps that left frames for the next one.
    std::uint64_t commands{};          ///< RawCommands sent.
    std::uint64_t commands_refused{};  ///< RawCommands that the gate or the bus did not take.
    std::uint64_t went_offline{};      ///< Nodes not heard for 3 s.
    std::uint64_t bus_errors{};
  };

  /// Preconditions: config.validate() is kOk, asserted; gate sends on `bus`.
  Node(const Config& config, TransmitGate& gate, CanBus& bus,
       std::span<Reassembler::Session> sessions) noexcept;

  /// Hears at most most_frames_a_step frames, then sends what is due: RawCommand every command_period (zeros
  /// while not armed, full length), ArmingStatus at 2 Hz, NodeStatus at 1 Hz.
  /// kOk, or the first error of the bus. RT-safe: O(most_frames_a_step * sessions), no allocation.
  [[nodiscard]] Status step(MonotonicTime now, const Input& in) noexcept;

  /// 0: none yet.
  [[nodiscard]] std::uint8_t node_id() const noexcept { return gate_.node_id(); }
  [[nodiscard]] const Inbox& inbox() const noexcept { return inbox_; }
  /// A NodeStatus came within the last 3 s.
  [[nodiscard]] bool online(std::uint8_t node_id, MonotonicTime now) const noexcept;
  [[nodiscard]] const Heard<NodeStatus>& status_of(std::uint8_t node_id) const noexcept {
    return nodes_[node_id & kMostNodeId].status;
  }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const Reassembler::Counters& reassembly() const noexcept { return reassembler_.counters(); }

 private:
  struct Neighbour {
    Heard<NodeStatus> status;
    bool offline{false};
  };

  [[nodiscard]] Status hear(MonotonicTime now) noexcept;
  void take(const Transfer& transfer, MonotonicTime now) noexcept;
  template <typename T>
  void keep(const Transfer& transfer, Heard<T>& heard) noexcept;
  void answer_node_info(const Transfer& transfer, MonotonicTime now) noexcept;
  void watch_neighbours(MonotonicTime now) noexcept;
  void allocate(MonotonicTime now) noexcept;
  void command(MonotonicTime now, const Input& in) noexcept;

  Config config_;
  TransmitGate& gate_;
  CanBus& bus_;
  Reassembler reassembler_;
  AllocationClient allocation_;
  Inbox inbox_{};
  std::array<Neighbour, kMostNodeId + 1> nodes_{};
  NodeStatus own_status_{};
  bool started_{false};
  MonotonicTime start_{};
  MonotonicTime next_command_{};
  MonotonicTime next_status_{};
  MonotonicTime next_arming_{};
  Counters counters_{};
};

constexpr Status Node::Config::validate() const noexcept {
  bool identified = false;
  for (const std::uint8_t byte : unique_id) identified = identified || byte != 0;
  const bool good = node_id <= kMostNodeId && (node_id != 0 || identified) && name.size() <= 80 &&
                    esc_count >= 1 && esc_count <= 20 && command_period >= Nanos{2'500'000} &&
                    command_period <= Nanos{20'000'000} && most_frames_a_step >= 1;
  return good ? Status::kOk : Status::kInvalidArgument;
}

}  // namespace roborun::firmware_if::dronecan
