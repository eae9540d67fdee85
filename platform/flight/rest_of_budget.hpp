/// A budget of which a part is spent already: for stages whose step is several calls, each of which counts from zero.
#pragma once

#include "core/executive/stage_budget.hpp"

namespace roborun::flight {

/// RT-safe. `whole` and `before` must outlive it; what `before` grows by meanwhile counts, too.
class RestOfBudget final : public core::StageBudget {
 public:
  RestOfBudget(core::StageBudget& whole, const core::Work& before) noexcept
      : whole_(whole), before_(before) {}
  [[nodiscard]] bool spent(const core::Work& done) noexcept override {
    core::Work all = before_;
    all.units += done.units;
    all.volume_m3 += done.volume_m3;
    return whole_.spent(all);
  }

 private:
  core::StageBudget& whole_;
  const core::Work& before_;
};

}  // namespace roborun::flight
