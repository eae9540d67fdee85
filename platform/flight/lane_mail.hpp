/// What the flight lane and the decision lane tell each other.
#pragma once

#include <optional>

#include "core/exchange/mailbox.hpp"
#include "core/geometry/vector.hpp"
#include "core/trajectory.hpp"
#include "firmware_if/time.hpp"
#include "governor/failsafe/arbiter.hpp"
#include "platform/flight/gaze.hpp"
#include "stages/control/estimator.hpp"
#include "stages/perception/frame_guard.hpp"

namespace roborun::flight {

/// Flight lane to decision lane, every minor frame. What is large is written only where it has changed since
/// this cell of the mailbox was written last.
struct FlightReport {
  stages::EstimatedState state{};
  bool estimated{false};  ///< There is a state.
  stages::PastStates past{Nanos{0}};
  Trajectory committed{};
  std::uint64_t committed_number{0};
  bool flying{false};
  bool airborne{false};
  governor::Action action{governor::Action::kGoOn};
  bool standing{false};
  Vector3 home_W = Vector3::Zero();
  double ground_m{};
};

/// Decision lane to flight lane, after every decision that found something.
struct Offer {
  Trajectory trajectory{};
  bool is_stop{false};  ///< Taken even while an overrun has the vehicle brake.
};

/// Decision lane to flight lane: how it is, at least once a decision.
struct DecisionReport {
  bool heard{false};
  MonotonicTime due{};      ///< When it wants to be back.
  MonotonicTime looked{};   ///< When it read its images last.
  std::uint32_t refused{};  ///< Bit i: the newest image of camera i was not believed.
  double depth_age_s{};
  /// The camera, or kMostCameras + the LiDAR, whose images are the oldest usable ones, and what was wrong with the newest; kNone:
  /// there was none.
  std::uint8_t depth_sensor{};
  stages::FrameFault depth_fault{};
  int failures{};      ///< Decisions in a row without a usable answer.
  int map_refusals{};  ///< Decisions in a row in which the map refused bricks.
  bool site_known{false};
  Vector3 site_W = Vector3::Zero();  ///< Below it everything is known to be free.
  /// What decides about the way is to be seen there: aside of the flight, or no way was found without it.
  std::optional<GazeTarget> gaze_target{};
};

struct LaneMail {
  core::Mailbox<FlightReport> report;
  core::Mailbox<Offer> offer;
  core::Mailbox<DecisionReport> decision;
};

}  // namespace roborun::flight
