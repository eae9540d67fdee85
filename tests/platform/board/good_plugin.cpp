/// A planner, a map and a memory of ways in one plugin; none of them does anything.
#include "platform/board/plugin.hpp"

namespace roborun::board {
namespace {

class Planner final : public stages::Planner {
 public:
  [[nodiscard]] Status plan(const stages::PlanRequest&, const stages::MapView&, core::StageBudget&,
                            stages::PlanResult&) noexcept override {
    return Status::kNoPath;
  }
};

class Map final : public stages::OccupancyMap, stages::MapView {
 public:
  explicit Map(const PartRequest& request) : side_(request.images.width) {}
  [[nodiscard]] Status integrate(const stages::IntegrationRequest&, core::StageBudget&,
                                 stages::IntegrationResult&) noexcept override {
    return Status::kInvalidArgument;
  }
  [[nodiscard]] Status export_view(const stages::ExportRequest&, core::StageBudget&,
                                   core::Work&) noexcept override {
    return Status::kOk;
  }
  void forget() noexcept override {}
  [[nodiscard]] const MapView& view() const noexcept override { return *this; }
  [[nodiscard]] double known_volume_m3() const noexcept override { return 0.0; }
  [[nodiscard]] std::size_t bytes() const noexcept override { return side_; }
  [[nodiscard]] std::uint64_t digest() const noexcept override { return 0; }

 private:
  [[nodiscard]] bool is_free(const Aabb&, std::uint64_t&) const noexcept override { return false; }
  [[nodiscard]] bool is_free_at_finest(const Aabb&, std::uint64_t&) const noexcept override { return false; }
  [[nodiscard]] stages::CellState at(const Vector3&, std::uint64_t&) const noexcept override {
    return stages::CellState::kUnknown;
  }
  [[nodiscard]] double cell_m() const noexcept override { return kPublishedCell_m; }

  std::size_t side_;
};

class Ways final : public stages::Ways {
 public:
  explicit Ways(const PartRequest& request) : room_m_(request.room_m) {}
  [[nodiscard]] Status look(const stages::MapView&, const stages::WayLook&, core::StageBudget&,
                            core::Work&) noexcept override {
    return Status::kOk;
  }
  [[nodiscard]] Status solve(const Vector3&, const Vector3&, core::StageBudget&,
                             core::Work&) noexcept override {
    return Status::kOk;
  }
  void forget() noexcept override {}
  [[nodiscard]] double to_goal_m(const Vector3&) const noexcept override { return room_m_; }
  [[nodiscard]] std::size_t known_way(const Vector3&, double, std::span<Vector3>) const noexcept override {
    return 0;
  }

 private:
  double room_m_;
};

}  // namespace
}  // namespace roborun::board

ROBORUN_PLUGIN_PLANNER(roborun::board::Planner)
ROBORUN_PLUGIN_MAP(roborun::board::Map)
ROBORUN_PLUGIN_WAYS(roborun::board::Ways)
