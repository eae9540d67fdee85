/// A map of boxes.
#pragma once

#include <cstdint>
#include <span>

#include "stages/perception/occupancy_map.hpp"
#include "tests/support/box_view.hpp"

namespace roborun::test {

/// Knows its boxes from the beginning, and takes nothing from images.
class BoxesMap final : public stages::OccupancyMap {
 public:
  BoxView box;
  std::uint64_t through{0};  ///< What saw_through() says of any cubes.
  [[nodiscard]] Status integrate(const stages::IntegrationRequest& /*request*/, core::StageBudget& /*budget*/,
                                 stages::IntegrationResult& /*result*/) noexcept override {
    return Status::kOk;
  }
  [[nodiscard]] Status export_view(const stages::ExportRequest& /*request*/, core::StageBudget& /*budget*/,
                                   core::Work& /*work*/) noexcept override {
    return Status::kOk;
  }
  void forget() noexcept override {}
  [[nodiscard]] const stages::MapView& view() const noexcept override { return box; }
  [[nodiscard]] std::uint64_t saw_through(MonotonicTime /*now*/,
                                          std::span<const Vector3> /*center_W*/) const noexcept override {
    return through;
  }
  [[nodiscard]] double known_volume_m3() const noexcept override { return 1e5; }
  [[nodiscard]] std::size_t bytes() const noexcept override { return 0; }
  [[nodiscard]] std::uint64_t digest() const noexcept override { return 0; }
};

}  // namespace roborun::test
