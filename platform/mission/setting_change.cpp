#include "platform/mission/setting_change.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "platform/flight/flight_system.hpp"
#include "platform/input/input_error.hpp"

namespace roborun::mission {
namespace {

class ChangingGovernor final : public governor::DecisionPolicy {
 public:
  ChangingGovernor(const governor::GovernorConfig& before, const governor::GovernorConfig& after,
                   const bool& is_due) noexcept
      : governor_(before), after_(after), is_due_(is_due) {}
  [[nodiscard]] governor::Decision decide(const SpaceProfile& profile,
                                          const governor::Situation& situation) noexcept override {
    if (is_due_ && !changed_) {
      governor_.configure(after_);
      changed_ = true;
    }
    return governor_.decide(profile, situation);
  }
  void observe(core::StageId id, double predicted_s, double spent_s) noexcept override {
    governor_.observe(id, predicted_s, spent_s);
  }
  [[nodiscard]] double v_max_mps() const noexcept override { return governor_.v_max_mps(); }

 private:
  governor::Governor governor_;
  governor::GovernorConfig after_;
  const bool& is_due_;
  bool changed_{false};
};

const GovernorKey& key_of(const std::string& name) {
  const auto* const at = std::find_if(kGovernorKeys.begin(), kGovernorKeys.end(),
                                      [&name](const GovernorKey& key) { return name == key.key; });
  if (at != kGovernorKeys.end()) return *at;
  std::string all;
  for (const GovernorKey& key : kGovernorKeys) all += std::string(all.empty() ? "" : ", ") + key.key;
  throw InputError(fmt::format("{}: no setting of the governor: must be {}", name, all));
}

}  // namespace

governor::GovernorConfig changed(const governor::GovernorConfig& config, const SettingChange& change) {
  governor::GovernorConfig after = config;
  for (const auto& [name, value] : change.to) {
    const GovernorKey& key = key_of(name);
    const double high = std::min(key.high, name == "flight.v_max_mps" ? config.v_max_mps : key.high);
    if (!(value >= key.low && value <= high))
      throw InputError(fmt::format("{}: {:g}: must be {:g} to {:g}", name, value, key.low, high));
    key.set(after, value);
  }
  if (after.validate() != Status::kOk)
    throw InputError(fmt::format("governor: must have shortest_s <= longest_s <= 15, not {:g} and {:g}",
                                 seconds(after.policy.shortest), seconds(after.policy.longest)));
  return after;
}

board::OwnParts parts_of(board::OwnParts own, const SettingChange& change, const bool& is_due) {
  if (!change.empty() && !own.policy)
    own.policy = [&change, &is_due](const flight::FlightConfig& flight) {
      const governor::GovernorConfig before = flight::governor_config(flight);
      return std::make_unique<ChangingGovernor>(before, changed(before, change), is_due);
    };
  return own;
}

}  // namespace roborun::mission
