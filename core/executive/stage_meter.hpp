/// Who knows what a stage has cost so far: a cost profile in virtual time, a clock in real time.
#pragma once

#include "core/executive/cost_profile.hpp"
#include "core/executive/stage_budget.hpp"
#include "firmware_if/time.hpp"

namespace roborun::core {

/// Contract:
///  1. No call blocks or allocates; all are O(1).
///  2. Within one decision, cost() of a stage never decreases while its work grows.
///  3. Time is charged to the stage last named by charge_to(), whoever runs.
class StageMeter {
 public:
  virtual ~StageMeter() = default;
  /// From now on this stage is the one that spends.
  virtual void charge_to(StageId id) noexcept = 0;
  /// What the stage has cost in this decision, having done `work`.
  [[nodiscard]] virtual Nanos cost(StageId id, const Work& work) const noexcept = 0;
  /// The stage is done in this decision: its final cost, which virtual time then moves on by.
  virtual Nanos settle(StageId id, const Work& work) noexcept = 0;
  /// What the stage may spend, given what the governor would grant: the executive may cut it.
  [[nodiscard]] virtual Nanos grant(StageId id, Nanos wanted) noexcept = 0;
};

/// The budget of one stage, on whatever meter the decision runs.
class MeteredBudget final : public StageBudget {
 public:
  MeteredBudget(const StageMeter& meter, StageId id, Nanos granted) noexcept
      : meter_(meter), id_(id), granted_(granted) {}
  [[nodiscard]] bool spent(const Work& done) noexcept override { return meter_.cost(id_, done) >= granted_; }

 private:
  const StageMeter& meter_;
  StageId id_;
  Nanos granted_;
};

}  // namespace roborun::core
