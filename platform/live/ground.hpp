/// Somebody on the ground: hears how the flight goes, and may give it another goal (`roborun goto`, or a ground station's
/// reposition). Over a link of his own, and through the autopilot's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/geometry/vector.hpp"
#include "firmware_if/mavlink/goal_request.hpp"
#include "firmware_if/mavlink/receiver.hpp"
#include "platform/live/far_end.hpp"
#include "platform/mavlink/link.hpp"
#include "platform/mavlink/signed_end.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::live {

inline constexpr std::uint8_t kGroundStation = 255;  ///< Its system id, if nobody says otherwise.
inline constexpr std::uint8_t kCompanion = 191;      ///< MAV_COMP_ID_ONBOARD_COMPUTER: ours.

struct GroundConfig {
  std::optional<mavlink::LinkAddress> link{};  ///< None: only through the autopilot.
  std::uint8_t sysid{kGroundStation};          ///< Who may ask; nobody else is heard.
};

/// Of the thread that watches. Nothing blocks.
class Ground {
 public:
  /// `key`: only signed requests are heard over its link, and what is sent is signed.
  Ground(const GroundConfig& config, const std::optional<firmware_if::mavlink::SecretKey>& key, FarEnd& far);

  /// Where the world begins; none: places on the earth are refused.
  void begins_at(const std::optional<sensor_port::EarthPlace>& origin) { origin_ = origin; }
  /// Height in the world of the ground that it stands on: heights over the take-off begin there.
  void stands_at(double height_m) { stands_m_ = height_m; }
  /// About twenty times a second: a goal that is asked for, in the world. To be answered before the next call.
  [[nodiscard]] std::optional<Vector3> step(MonotonicTime now);
  /// Null: the goal is flown to. Else why not.
  void answer(const char* refused);
  /// STATUSTEXT; severity as MAV_SEVERITY: 4 warning, 6 information.
  void say(std::uint8_t severity, std::string_view text);
  [[nodiscard]] std::uint64_t given() const noexcept { return given_; }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  template <typename T>
  void send(const T& message);
  /// The newest request of somebody who may ask.
  [[nodiscard]] std::optional<firmware_if::mavlink::GoalRequest> hear();
  /// Null: `goal_W` is where it lies.
  [[nodiscard]] const char* place(const firmware_if::mavlink::GoalRequest& request, Vector3& goal_W) const;

  std::uint8_t sysid_;
  FarEnd& far_;
  std::optional<mavlink::Link> link_;
  static constexpr std::uint8_t kLinkId = 2;
  std::unique_ptr<mavlink::SignedEnd> signed_;
  firmware_if::mavlink::Receiver receiver_;
  MonotonicTime now_{}, beat_at_{Nanos{-1'000'000'000}}, refused_at_{Nanos{-1'000'000'000}};
  std::array<std::uint8_t, 4096> bytes_{};
  std::uint8_t seq_{0};
  std::uint16_t text_id_{0};
  std::optional<sensor_port::EarthPlace> origin_;
  double stands_m_{0.0};
  firmware_if::mavlink::GoalRequest request_{};
  bool through_autopilot_{false};
  Vector3 goal_W_ = Vector3::Zero();
  std::optional<Vector3> flown_W_;  ///< What was given last.
  std::uint64_t given_{0}, refused_{0};
};

}  // namespace roborun::live
