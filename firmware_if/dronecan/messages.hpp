/// The DroneCAN messages that roborun speaks, each as one table of its fields. Field names, units and value
/// ranges are those of the public DSDL definitions (dronecan/DSDL, namespaces uavcan and ardupilot); the signature that the
/// tables give is compared with the published one at compile time, so a wrong row does not build.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <tuple>

#include "firmware_if/dronecan/sensor_messages.hpp"
#include "firmware_if/dronecan/wire.hpp"

namespace roborun::firmware_if::dronecan {

/// To the ESCs: one throttle an ESC, in the order of their indices; -8191 .. 8191 is full reverse .. full
/// forward.
struct EscRawCommand {
  static constexpr std::string_view kName{"uavcan.equipment.esc.RawCommand"};
  Dynamic<Int<14>, 20>::Value cmd{};
  static constexpr std::tuple kFields{
      Field<Dynamic<Int<14>, 20>, &EscRawCommand::cmd>{"cmd"},
  };
};

/// To the ESCs: one speed an ESC, revolutions a minute.
struct EscRpmCommand {
  static constexpr std::string_view kName{"uavcan.equipment.esc.RPMCommand"};
  Dynamic<Int<18>, 20>::Value rpm{};
  static constexpr std::tuple kFields{
      Field<Dynamic<Int<18>, 20>, &EscRpmCommand::rpm>{"rpm"},
  };
};

/// From an ESC, about 10 Hz.
struct EscStatus {
  static constexpr std::string_view kName{"uavcan.equipment.esc.Status"};
  Uint<32>::Value error_count{};
  Float<16>::Value voltage{};      ///< V
  Float<16>::Value current{};      ///< A
  Float<16>::Value temperature{};  ///< K
  Int<18>::Value rpm{};
  Uint<7>::Value power_rating_pct{};
  Uint<5>::Value esc_index{};
  static constexpr std::tuple kFields{
      Field<Uint<32>, &EscStatus::error_count>{"error_count"},
      Field<Float<16>, &EscStatus::voltage>{"voltage"},
      Field<Float<16>, &EscStatus::current>{"current"},
      Field<Float<16>, &EscStatus::temperature>{"temperature"},
      Field<Int<18>, &EscStatus::rpm>{"rpm"},
      Field<Uint<7>, &EscStatus::power_rating_pct>{"power_rating_pct"},
      Field<Uint<5>, &EscStatus::esc_index>{"esc_index"},
  };
};

/// From every node, at least every 1 s; silent for 3 s is offline.
struct NodeStatus {
  static constexpr std::string_view kName{"uavcan.protocol.NodeStatus"};
  Uint<32>::Value uptime_sec{};
  Uint<2>::Value health{};  ///< 0 ok, 1 warning, 2 error, 3 critical.
  Uint<3>::Value mode{};    ///< 0 operational, 1 initialisation, 2 maintenance, 3 software update, 7 offline.
  Uint<3>::Value sub_mode{};
  Uint<16>::Value vendor_specific_status_code{};
  static constexpr std::tuple kFields{
      Field<Uint<32>, &NodeStatus::uptime_sec>{"uptime_sec"},
      Field<Uint<2>, &NodeStatus::health>{"health"},
      Field<Uint<3>, &NodeStatus::mode>{"mode"},
      Field<Uint<3>, &NodeStatus::sub_mode>{"sub_mode"},
      Field<Uint<16>, &NodeStatus::vendor_specific_status_code>{"vendor_specific_status_code"},
  };
};

/// From us: 0 disarmed, 255 fully armed.
struct ArmingStatus {
  static constexpr std::string_view kName{"uavcan.equipment.safety.ArmingStatus"};
  Uint<8>::Value status{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &ArmingStatus::status>{"status"},
  };
};

/// To the package release: 0 releases, 1 holds.
struct HardpointCommand {
  static constexpr std::string_view kName{"uavcan.equipment.hardpoint.Command"};
  Uint<8>::Value hardpoint_id{};
  Uint<16>::Value command{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &HardpointCommand::hardpoint_id>{"hardpoint_id"},
      Field<Uint<16>, &HardpointCommand::command>{"command"},
  };
};

/// From the package release.
struct HardpointStatus {
  static constexpr std::string_view kName{"uavcan.equipment.hardpoint.Status"};
  Uint<8>::Value hardpoint_id{};
  Float<16>::Value payload_weight{};  ///< N
  Float<16>::Value payload_weight_variance{};
  Uint<16>::Value status{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &HardpointStatus::hardpoint_id>{"hardpoint_id"},
      Field<Float<16>, &HardpointStatus::payload_weight>{"payload_weight"},
      Field<Float<16>, &HardpointStatus::payload_weight_variance>{"payload_weight_variance"},
      Field<Uint<16>, &HardpointStatus::status>{"status"},
  };
};

/// From a power module.
struct BatteryInfo {
  static constexpr std::string_view kName{"uavcan.equipment.power.BatteryInfo"};
  Float<16>::Value temperature{};          ///< K
  Float<16>::Value voltage{};              ///< V
  Float<16>::Value current{};              ///< A
  Float<16>::Value average_power_10sec{};  ///< W
  Float<16>::Value remaining_capacity_wh{};
  Float<16>::Value full_charge_capacity_wh{};
  Float<16>::Value hours_to_full_charge{};
  Uint<11>::Value status_flags{};
  Uint<7>::Value state_of_health_pct{};  ///< 127: unknown.
  Uint<7>::Value state_of_charge_pct{};
  Uint<7>::Value state_of_charge_pct_stdev{};
  Uint<8>::Value battery_id{};
  Uint<32>::Value model_instance_id{};
  Dynamic<Uint<8>, 31>::Value model_name{};  ///< Text.
  static constexpr std::tuple kFields{
      Field<Float<16>, &BatteryInfo::temperature>{"temperature"},
      Field<Float<16>, &BatteryInfo::voltage>{"voltage"},
      Field<Float<16>, &BatteryInfo::current>{"current"},
      Field<Float<16>, &BatteryInfo::average_power_10sec>{"average_power_10sec"},
      Field<Float<16>, &BatteryInfo::remaining_capacity_wh>{"remaining_capacity_wh"},
      Field<Float<16>, &BatteryInfo::full_charge_capacity_wh>{"full_charge_capacity_wh"},
      Field<Float<16>, &BatteryInfo::hours_to_full_charge>{"hours_to_full_charge"},
      Field<Uint<11>, &BatteryInfo::status_flags>{"status_flags"},
      Field<Uint<7>, &BatteryInfo::state_of_health_pct>{"state_of_health_pct"},
      Field<Uint<7>, &BatteryInfo::state_of_charge_pct>{"state_of_charge_pct"},
      Field<Uint<7>, &BatteryInfo::state_of_charge_pct_stdev>{"state_of_charge_pct_stdev"},
      Field<Uint<8>, &BatteryInfo::battery_id>{"battery_id"},
      Field<Uint<32>, &BatteryInfo::model_instance_id>{"model_instance_id"},
      Field<Dynamic<Uint<8>, 31>, &BatteryInfo::model_name>{"model_name"},
  };
};

/// From the bus's time master.
struct GlobalTimeSync {
  static constexpr std::string_view kName{"uavcan.protocol.GlobalTimeSync"};
  Uint<56, Cast::kTruncated>::Value previous_transmission_timestamp_usec{};
  static constexpr std::tuple kFields{
      Field<Uint<56, Cast::kTruncated>, &GlobalTimeSync::previous_transmission_timestamp_usec>{
          "previous_transmission_timestamp_usec"},
  };
};

/// Part of others.
struct Rgb565 {
  static constexpr std::string_view kName{"uavcan.equipment.indication.RGB565"};
  Uint<5>::Value red{};
  Uint<6>::Value green{};
  Uint<5>::Value blue{};
  static constexpr std::tuple kFields{
      Field<Uint<5>, &Rgb565::red>{"red"},
      Field<Uint<6>, &Rgb565::green>{"green"},
      Field<Uint<5>, &Rgb565::blue>{"blue"},
  };
};

/// Part of LightsCommand.
struct SingleLightCommand {
  static constexpr std::string_view kName{"uavcan.equipment.indication.SingleLightCommand"};
  Uint<8>::Value light_id{};
  Nested<Rgb565>::Value color{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &SingleLightCommand::light_id>{"light_id"},
      Field<Nested<Rgb565>, &SingleLightCommand::color>{"color"},
  };
};

/// To the lights.
struct LightsCommand {
  static constexpr std::string_view kName{"uavcan.equipment.indication.LightsCommand"};
  Dynamic<Nested<SingleLightCommand>, 20>::Value commands{};
  static constexpr std::tuple kFields{
      Field<Dynamic<Nested<SingleLightCommand>, 20>, &LightsCommand::commands>{"commands"},
  };
};

/// Dynamic node-id allocation, both directions.
struct Allocation {
  static constexpr std::string_view kName{"uavcan.protocol.dynamic_node_id.Allocation"};
  Uint<7>::Value node_id{};  ///< 0: any.
  Bool::Value first_part_of_unique_id{};
  Dynamic<Uint<8>, 16>::Value unique_id{};
  static constexpr std::tuple kFields{
      Field<Uint<7>, &Allocation::node_id>{"node_id"},
      Field<Bool, &Allocation::first_part_of_unique_id>{"first_part_of_unique_id"},
      Field<Dynamic<Uint<8>, 16>, &Allocation::unique_id>{"unique_id"},
  };
};

/// Part of GetNodeInfoResponse.
struct SoftwareVersion {
  static constexpr std::string_view kName{"uavcan.protocol.SoftwareVersion"};
  Uint<8>::Value major{};
  Uint<8>::Value minor{};
  Uint<8>::Value optional_field_flags{};  ///< 1: vcs_commit is set, 2: image_crc is set.
  Uint<32>::Value vcs_commit{};
  Uint<64>::Value image_crc{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &SoftwareVersion::major>{"major"},
      Field<Uint<8>, &SoftwareVersion::minor>{"minor"},
      Field<Uint<8>, &SoftwareVersion::optional_field_flags>{"optional_field_flags"},
      Field<Uint<32>, &SoftwareVersion::vcs_commit>{"vcs_commit"},
      Field<Uint<64>, &SoftwareVersion::image_crc>{"image_crc"},
  };
};

/// Part of GetNodeInfoResponse.
struct HardwareVersion {
  static constexpr std::string_view kName{"uavcan.protocol.HardwareVersion"};
  Uint<8>::Value major{};
  Uint<8>::Value minor{};
  Fixed<Uint<8>, 16>::Value unique_id{};
  Dynamic<Uint<8>, 255>::Value certificate_of_authenticity{};
  static constexpr std::tuple kFields{
      Field<Uint<8>, &HardwareVersion::major>{"major"},
      Field<Uint<8>, &HardwareVersion::minor>{"minor"},
      Field<Fixed<Uint<8>, 16>, &HardwareVersion::unique_id>{"unique_id"},
      Field<Dynamic<Uint<8>, 255>, &HardwareVersion::certificate_of_authenticity>{
          "certificate_of_authenticity"},
  };
};

/// Who are you? Asked of a node.
struct GetNodeInfoRequest {
  static constexpr std::string_view kName{"uavcan.protocol.GetNodeInfo"};
  static constexpr std::tuple<> kFields{};
};

/// The answer.
struct GetNodeInfoResponse {
  static constexpr std::string_view kName{"uavcan.protocol.GetNodeInfo"};
  Nested<NodeStatus>::Value status{};
  Nested<SoftwareVersion>::Value software_version{};
  Nested<HardwareVersion>::Value hardware_version{};
  Dynamic<Uint<8>, 80>::Value name{};  ///< Text.
  static constexpr std::tuple kFields{
      Field<Nested<NodeStatus>, &GetNodeInfoResponse::status>{"status"},
      Field<Nested<SoftwareVersion>, &GetNodeInfoResponse::software_version>{"software_version"},
      Field<Nested<HardwareVersion>, &GetNodeInfoResponse::hardware_version>{"hardware_version"},
      Field<Dynamic<Uint<8>, 80>, &GetNodeInfoResponse::name>{"name"},
  };
};

/// What a transfer of a type needs besides its payload.
enum class TransferKind : std::uint8_t { kMessage, kRequest, kResponse };
struct DataType {
  std::string_view name;
  TransferKind kind{};
  std::uint16_t id{};
  std::uint64_t signature{};
  std::size_t max_payload_bytes{};
};

template <typename T>
struct TypeOf {
  static constexpr TransferKind kKind = TransferKind::kMessage;
  static constexpr std::uint64_t kSignature = message_signature<T>();
};
template <TransferKind kKindOf>
struct GetNodeInfoType {
  static constexpr TransferKind kKind = kKindOf;
  static constexpr std::uint64_t kSignature = service_signature<GetNodeInfoRequest, GetNodeInfoResponse>();
};
template <>
struct TypeOf<GetNodeInfoRequest> : GetNodeInfoType<TransferKind::kRequest> {};
template <>
struct TypeOf<GetNodeInfoResponse> : GetNodeInfoType<TransferKind::kResponse> {};

/// One row of the dictionary; does not compile if the table of T does not give the published signature.
template <typename T, std::uint16_t kId, std::uint64_t kPublished>
struct Entry {
  using Message = T;
  static_assert(TypeOf<T>::kSignature == kPublished, "the table differs from the published definition");
  static constexpr DataType kType{T::kName, TypeOf<T>::kKind, kId, kPublished, kMaxPayload_bytes<T>};
};

/// Every type that has a number, with its published signature.
using Dictionary = std::tuple<
    Entry<EscRawCommand, 1030, 0x217f5c87d7ec951dULL>, Entry<EscRpmCommand, 1031, 0xce0f9f621cf7e70bULL>,
    Entry<EscStatus, 1034, 0xa9af28aea2fbb254ULL>, Entry<NodeStatus, 341, 0x0f0868d0c1a7c6f1ULL>,
    Entry<ArmingStatus, 1100, 0x8700f375556a8003ULL>, Entry<HardpointCommand, 1070, 0xa1a036268b0c3455ULL>,
    Entry<HardpointStatus, 1071, 0x624a519d42553d82ULL>, Entry<RawImu, 1003, 0x8280632c40e574b5ULL>,
    Entry<AhrsSolution, 1000, 0x72a63a3c6f41fa9bULL>, Entry<GnssFix2, 1063, 0xca41e7000f37435fULL>,
    Entry<BatteryInfo, 1092, 0x249c26548a711966ULL>, Entry<RangeMeasurement, 1050, 0x68fffe70fc771952ULL>,
    Entry<StaticPressure, 1028, 0xcdc7c43412bdc89aULL>, Entry<GlobalTimeSync, 4, 0x20271116a793c2dbULL>,
    Entry<StaticTemperature, 1029, 0x49272a6477d96271ULL>,
    Entry<MagneticFieldStrength, 1001, 0xe2a7d4a9460bc2f2ULL>,
    Entry<MagneticFieldStrength2, 1002, 0xb6ac0c442430297eULL>,
    Entry<GnssHeading, 20002, 0x315cae39eced3412ULL>, Entry<LightsCommand, 1081, 0x2031d93c8bdd1ec4ULL>,
    Entry<Allocation, 1, 0x0b2a812620a11d40ULL>, Entry<GetNodeInfoRequest, 1, 0xee468a8121c46a9eULL>,
    Entry<GetNodeInfoResponse, 1, 0xee468a8121c46a9eULL>>;

namespace detail {

template <typename T, typename... Entries>
constexpr DataType find_type(std::tuple<Entries...>* /*dictionary*/) noexcept {
  DataType found;
  ((std::is_same_v<T, typename Entries::Message> ? void(found = Entries::kType) : void()), ...);
  return found;
}
template <typename... Entries>
constexpr std::array<DataType, sizeof...(Entries)> all_types(
    std::tuple<Entries...>* /*dictionary*/) noexcept {
  return {Entries::kType...};
}

}  // namespace detail

template <typename T>
inline constexpr DataType kType = detail::find_type<T>(static_cast<Dictionary*>(nullptr));

/// The dictionary as run-time rows.
inline constexpr auto kAllTypes = detail::all_types(static_cast<Dictionary*>(nullptr));

}  // namespace roborun::firmware_if::dronecan
