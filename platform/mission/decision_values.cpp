#include "platform/mission/decision_values.hpp"

#include <fmt/format.h>

#include <bit>

#include "core/record/state_hash.hpp"

namespace roborun::mission {
namespace {

enum class Form : std::uint8_t { kWhole, kReal, kNanos, kStatus, kHash };
struct ValueSpec {
  const char* stage;
  const char* name;
  Form form;
};

// clang-format off
constexpr std::array<ValueSpec, kDecisionValues> kValues{{
    {"point_cloud", "time", Form::kNanos}, {"point_cloud", "units", Form::kWhole}, {"point_cloud", "volume_m3", Form::kReal},
    {"governor", "time", Form::kNanos}, {"governor", "units", Form::kWhole}, {"governor", "volume_m3", Form::kReal},
    {"governor", "time_budget", Form::kNanos}, {"governor", "deadline", Form::kNanos}, {"governor", "p0_level", Form::kWhole},
    {"governor", "p1_level", Form::kWhole}, {"governor", "speed_limit_mps", Form::kReal},
    {"map", "time", Form::kNanos}, {"map", "units", Form::kWhole}, {"map", "volume_m3", Form::kReal},
    {"export", "time", Form::kNanos}, {"export", "units", Form::kWhole}, {"export", "volume_m3", Form::kReal},
    {"planner", "time", Form::kNanos}, {"planner", "units", Form::kWhole}, {"planner", "volume_m3", Form::kReal},
    {"planner", "status", Form::kStatus},
    {"smoother", "time", Form::kNanos}, {"smoother", "units", Form::kWhole}, {"smoother", "volume_m3", Form::kReal},
    {"smoother", "status", Form::kStatus},
    {"hand_over", "kind", Form::kWhole}, {"hand_over", "trajectory", Form::kHash},
}};
// clang-format on

}  // namespace

std::uint64_t hash_of(const Trajectory& trajectory) noexcept {
  core::StateHash hash;
  hash.add(static_cast<std::uint64_t>(trajectory.start_time.time_since_epoch().count()));
  for (std::size_t i = 0; i < trajectory.segment_count; ++i) {
    hash.add(trajectory.segment[i].duration_s);
    for (const Vector3& c : trajectory.segment[i].coefficient) hash.add(c);
  }
  return hash.value();
}

DecisionValues values_of(const flight::DecisionOutput& d) noexcept {
  DecisionValues values{};
  std::size_t at = 0;
  const auto whole = [&](auto value) { values[at++] = static_cast<std::uint64_t>(value); };
  const auto real = [&](double value) { values[at++] = std::bit_cast<std::uint64_t>(value); };
  const auto stage = [&](core::StageId id) {
    whole(d.cost[id].count());
    whole(d.work[id].units);
    real(d.work[id].volume_m3);
  };
  stage(core::StageId::kPointCloud);
  stage(core::StageId::kGovernor);
  whole(d.decision.time_budget.count());
  whole(d.decision.point.deadline.count());
  whole(d.decision.point.p0_level);
  whole(d.decision.point.p1_level);
  real(d.decision.point.speed_limit_mps);
  stage(core::StageId::kMap);
  stage(core::StageId::kExport);
  stage(core::StageId::kPlanner);
  whole(d.planner_status);
  stage(core::StageId::kSmoother);
  whole(d.smoother_status);
  whole(d.kind);
  whole(d.kind == flight::DecisionKind::kKeep ? 0 : hash_of(d.trajectory));
  return values;
}

NamedValue name_of_value(std::size_t index) noexcept { return {kValues[index].stage, kValues[index].name}; }

std::string text_of_value(std::size_t index, std::uint64_t bits) {
  switch (kValues[index].form) {
    case Form::kReal:
      return fmt::format("{}", std::bit_cast<double>(bits));
    case Form::kNanos:
      return fmt::format("{:.9f} s", 1e-9 * static_cast<double>(static_cast<std::int64_t>(bits)));
    case Form::kStatus:
      return to_string(static_cast<Status>(bits));
    case Form::kHash:
      return fmt::format("{:016x}", bits);
    default:
      return fmt::format("{}", bits);
  }
}

}  // namespace roborun::mission
