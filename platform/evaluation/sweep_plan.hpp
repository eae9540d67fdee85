/// What a sweep flies: environments x profiles x designs x seeds, and everything else that its results depend
/// on. An environment of a suite of worlds (suite.hpp) is "WORLD/VEHICLE", one of the paper's 27 its number. Two sweeps of equal plans have equal results, bit for bit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "platform/report/mission_result.hpp"

namespace roborun::evaluation {

/// One line of the results.
struct SweepMission {
  std::string environment;
  std::string profile;
  std::string design;
  std::uint64_t seed{};
};

struct SweepPlan {
  struct ProfileId {
    std::string name;
    std::string digest;  ///< Of the numbers in it.
  };
  std::string commit;  ///< Of the sources (report::BuildIdentity); empty in plans of before it was kept.
  std::string build;   ///< Digest of the program that flies.
  std::string suite{"paper27"};
  std::string mission{"package_delivery"};
  std::vector<std::string> environments;
  std::vector<ProfileId> profiles;
  std::vector<std::string> designs;
  std::vector<std::uint64_t> seeds;
  std::string map{"own"};
  std::string planner{"own"};
  std::string vehicle;   ///< Names and digests; empty in plans of before there were others.
  std::string worlds;    ///< Digest of the files of a suite, or empty.
  std::string settings;  ///< Digest of the settings file, or empty.
  std::string aim;       ///< In the place of that of the settings, or empty.
  int shard{1};          ///< 1 .. shards.
  int shards{1};
};

/// The missions of the plan's shard, in the order of the results file. Shards differ by at most one mission,
/// and each gets its part of every design.
[[nodiscard]] std::vector<SweepMission> missions_of(const SweepPlan& plan);
/// Missions of environment 14 (or the middle one of the list) in the first profile: their flights are kept.
/// That of the first seed is drawn.
[[nodiscard]] bool is_representative(const SweepPlan& plan, const SweepMission& mission);
/// Unique within a plan; also what a person reads.
[[nodiscard]] std::string name_of(const SweepMission& mission);
[[nodiscard]] SweepMission mission_of_result(const report::MissionResult& result);

/// Several lines of JSON.
[[nodiscard]] std::string to_json(const SweepPlan& plan);
/// Throws InputError that names the file.
[[nodiscard]] SweepPlan plan_from_json(const std::string& path, const std::string& text);
/// The first field in which two plans differ, or empty.
[[nodiscard]] std::string difference(const SweepPlan& a, const SweepPlan& b);

/// 16 hexadecimal digits.
[[nodiscard]] std::string digest_of(const std::string& bytes);

}  // namespace roborun::evaluation
