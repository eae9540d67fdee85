#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "platform/board/board_profile.hpp"
#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"
#include "platform/mission/mission.hpp"
#include "platform/mission/recorded_flight.hpp"
#include "platform/mission/recording.hpp"
#include "platform/sitl/world/world_file.hpp"
#include "stages/perception/octomap_backend/octomap_backend.hpp"
#include "stages/planning/ompl_backend/ompl_backend.hpp"
#include "stages/planning/way_memory.hpp"
#include "tests/platform/mission/refusal.hpp"
#include "tests/support/scratch.hpp"

namespace roborun::mission {
namespace {

/// Asks the governor that ships, and counts.
class PassingPolicy final : public governor::DecisionPolicy {
 public:
  PassingPolicy(const governor::GovernorConfig& config, int& decisions) noexcept
      : governor_(config), decisions_(decisions) {}
  [[nodiscard]] governor::Decision decide(const SpaceProfile& profile,
                                          const governor::Situation& situation) noexcept override {
    ++decisions_;
    return governor_.decide(profile, situation);
  }
  void observe(core::StageId id, double predicted_s, double spent_s) noexcept override {
    governor_.observe(id, predicted_s, spent_s);
  }
  [[nodiscard]] double v_max_mps() const noexcept override { return governor_.v_max_mps(); }

 private:
  governor::Governor governor_;
  int& decisions_;
};

/// Asks the memory that ships, and counts.
class PassingWays final : public stages::Ways {
 public:
  PassingWays(const stages::WayMemory::Config& config, int& solved)
      : block_(stages::WayMemory::arena_bytes(config)),
        arena_(block_),
        memory_(config, arena_),
        solved_(solved) {}
  [[nodiscard]] Status look(const stages::MapView& map, const stages::WayLook& look,
                            core::StageBudget& budget, core::Work& work) noexcept override {
    return memory_.look(map, look, budget, work);
  }
  [[nodiscard]] Status solve(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                             core::Work& work) noexcept override {
    ++solved_;
    return memory_.solve(from_W, goal_W, budget, work);
  }
  void forget() noexcept override { memory_.forget(); }
  [[nodiscard]] double to_goal_m(const Vector3& p_W) const noexcept override {
    return memory_.to_goal_m(p_W);
  }
  [[nodiscard]] std::size_t known_way(const Vector3& from_W, double within_m,
                                      std::span<Vector3> way_W) const noexcept override {
    return memory_.known_way(from_W, within_m, way_W);
  }

 private:
  std::vector<std::byte> block_;
  core::Arena arena_;
  stages::WayMemory memory_;
  int& solved_;
};

class OwnPartsTest : public ::testing::Test {
 protected:
  OwnPartsTest() : world_(sitl::load_world(std::string(ROBORUN_TEST_DATA) + "/worlds/two_pillars.toml", {})) {
    config_.flight.costs = board::paper().costs;
    config_.flight.model = board::paper().model;
  }
  [[nodiscard]] std::string refusal() const { return refusal_of(world_, config_); }
  sitl::World world_;
  MissionConfig config_;
};

TEST_F(OwnPartsTest, APolicyThatAsksTheGovernorFliesTheSameBits) {
  const std::string hash = fly_mission(world_, config_, {}).result.state_hash;
  int decisions = 0;
  config_.own.policy = [&decisions](const flight::FlightConfig& config) {
    return std::make_unique<PassingPolicy>(flight::governor_config(config), decisions);
  };
  const report::MissionResult own = fly_mission(world_, config_, {}).result;
  EXPECT_EQ(own.state_hash, hash);
  EXPECT_EQ(static_cast<std::uint64_t>(decisions), own.decisions);
  EXPECT_GT(decisions, 5);
  EXPECT_EQ(own.design, "custom");
}

TEST_F(OwnPartsTest, MapAndPlannerFromFactoriesFlyAsThoseByName) {
  config_.judge.time_limit_s = 8.0;  // the stock map is slow
  config_.simulator.camera.pixels = 32;
  config_.backends = {"octomap", "ompl:RRTstar"};
  const report::MissionResult by_name = fly_mission(world_, config_, {}).result;
  config_.backends = {};
  config_.own.map = [](const board::PartRequest& r) {
    return stages::make_octomap_backend(
        {r.map_bounds_W, r.images.vehicle_radius_m, r.images.lattice, r.images.range_m + 5.0});
  };
  config_.own.planner = [](const board::PartRequest&) { return stages::make_ompl_planner("RRTstar", {}); };
  const report::MissionResult own = fly_mission(world_, config_, {}).result;
  EXPECT_GT(own.decisions, 0U);
  EXPECT_EQ(own.state_hash, by_name.state_hash);
  EXPECT_EQ(own.map, "custom");
  EXPECT_EQ(own.planner, "custom");
}

TEST_F(OwnPartsTest, WaysThatAskTheMemoryThatShipsFlyTheSameBits) {
  const std::string hash = fly_mission(world_, config_, {}).result.state_hash;
  int solved = 0;
  config_.own.ways = [&solved](const board::PartRequest& r) {
    const stages::WayMemory::Config config{r.flight_bounds_W, r.room_m, r.images.lattice.finest_m, r.fence,
                                           r.images.vehicle_radius_m};
    return std::make_unique<PassingWays>(config, solved);
  };
  const report::MissionResult own = fly_mission(world_, config_, {}).result;
  EXPECT_EQ(own.state_hash, hash);
  EXPECT_GT(solved, 5);
  EXPECT_EQ(own.ways, "custom");
  config_.flight.design = governor::Design::kStatic;
  EXPECT_NE(refusal().find("ways: design static knows its horizon alone"), std::string::npos) << refusal();
}

TEST_F(OwnPartsTest, AFactoryThatMakesNothingIsRefused) {
  config_.own.planner = [](const board::PartRequest&) { return nullptr; };
  EXPECT_NE(refusal().find("not enough memory"), std::string::npos) << refusal();
}

TEST_F(OwnPartsTest, AreNoInputsOfALog) {
  EXPECT_EQ(why_not_replayed(config_), "");
  config_.backends.planner = "plugin:x.so";
  EXPECT_NE(why_not_replayed(config_).find("code of others"), std::string::npos);
  config_.backends = {};
  config_.own.planner = [](const board::PartRequest&) { return stages::make_ompl_planner("RRTstar", {}); };
  EXPECT_NE(why_not_replayed(config_).find("code of others"), std::string::npos);
}

TEST_F(OwnPartsTest, ARecordingDoesNotChooseWhatCodeIsLoaded) {
  RecordedFlight recorded;
  recorded.flight = flight_config_of(world_, config_);
  recorded.sensors = sitl::rig_of(config_.simulator);
  recorded.mounts.resize(recorded.sensors.cameras.size());
  const auto read = [&recorded] {
    const std::string json = to_json(recorded);
    return recorded_flight_from(json);
  };
  EXPECT_EQ(read().backends, board::BackendNames{});
  recorded.backends.map = "plugin:/tmp/x.so";
  EXPECT_THROW((void)read(), InputError);
}

}  // namespace
}  // namespace roborun::mission
