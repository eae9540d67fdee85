/// Memory, map, planner and memory of ways of a flight, taken before it begins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/memory/arena.hpp"
#include "platform/board/backends.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/mission/flight_memory.hpp"
#include "platform/report/mission_result.hpp"

namespace roborun::mission {

/// Huge pages: a twentieth of the page faults at the start, for flights in lockstep. On real time the kernel must not rearrange them.
enum class Pages : std::uint8_t { kNormal, kHuge };

class FlightSetup {
 public:
  /// Throws InputError as make_backends(), and for ways that the design does not know.
  FlightSetup(const flight::FlightConfig& config, const board::BackendNames& backends,
              const board::ImageLimits& images, const board::OwnParts& own = {},
              Pages pages = Pages::kNormal);
  FlightSetup(const FlightSetup&) = delete;
  FlightSetup& operator=(const FlightSetup&) = delete;

  [[nodiscard]] flight::FlightParts parts(std::span<firmware_if::DepthCamera* const> watched = {}) noexcept {
    return {*parts_.map, *parts_.planner, policy_.get(), parts_.ways.get(), watched};
  }
  [[nodiscard]] core::Arena& arena() noexcept { return arena_; }
  /// To be asked once the flight system stands. Throws InputError if the arena was too small.
  void check() const;
  /// Adds what of the flight is here. False: not all of its memory is known, as map or planner is not the own one.
  [[nodiscard]] bool add_to(FlightMemory& memory) const;
  /// The memory plan, with what was used so far. Pools of one name are numbered.
  [[nodiscard]] std::vector<report::PoolUse> pools() const;

 private:
  bool all_own_;  ///< Map, planner, policy and ways are those that ship.
  /// Pages of the kernel: all zero.
  class Block {
   public:
    Block(std::size_t bytes, Pages pages);
    ~Block();
    Block(const Block&) = delete;
    Block& operator=(const Block&) = delete;
    [[nodiscard]] std::span<std::byte> bytes() const noexcept { return bytes_; }

   private:
    std::span<std::byte> bytes_;
  };
  Block block_;
  core::Arena arena_;
  board::Backends parts_;
  std::unique_ptr<governor::DecisionPolicy> policy_;  ///< Null: the governor that ships.
};

}  // namespace roborun::mission
