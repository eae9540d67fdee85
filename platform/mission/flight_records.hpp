/// What a flight says to its log, from its programs.
#pragma once

#include "core/precision.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/log/log_records.hpp"

namespace roborun::mission {

/// Log records of state come so often, whatever the rate of the flight lane.
inline constexpr Nanos kStatePeriod{25'000'000};
/// And map slices so often at most.
inline constexpr Nanos kSlicePeriod{1'000'000'000};

/// Times count from `start`. RT-safe, as all of these: no allocation; the thread of the flight lane, or lockstep.
[[nodiscard]] log::StateRecord state_record(flight::FlightSystem& system, MonotonicTime now,
                                            MonotonicTime start, bool has_motors) noexcept;
/// `number` counts decisions from 1. The thread of the decision lane, or lockstep.
[[nodiscard]] log::DecisionEntry decision_entry(flight::FlightSystem& system,
                                                const flight::DecisionOutput& out,
                                                const PrecisionLattice& lattice, std::uint64_t number,
                                                MonotonicTime now, MonotonicTime start) noexcept;
[[nodiscard]] log::FailsafeEntry failsafe_entry(const flight::FailsafeEvent& event,
                                                MonotonicTime start) noexcept;
/// 128 x 128 cells around a place, at its height: the map's finest, or 2 x 2 or 4 x 4 of them as one, so that the slice is 25 m
/// wide or more. O(1): at most 32 x 32 blocks are read. The thread of the decision lane, or lockstep.
void fill_slice(const stages::MapView& view, const Vector3& p_W, log::MapSlice& slice) noexcept;

}  // namespace roborun::mission
