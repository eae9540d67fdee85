// Links every target of the component flight, and looks whether the flags that results depend on have come along.
#include <cstdio>
#include <typeinfo>

#include "governor/policy/governor.hpp"
#include "platform/flight/flight_system.hpp"
#include "stages/planning/rrt_star.hpp"

#ifndef EIGEN_DONT_VECTORIZE
#error "Eigen must not vectorise"
#endif
#ifndef EIGEN_MPL2_ONLY
#error "only those parts of Eigen"
#endif

namespace {

// With RTTI, from a class of a library without: its destructor is inline.
class Nobody final : public roborun::stages::Planner {
 public:
  [[nodiscard]] roborun::Status plan(const roborun::stages::PlanRequest&, const roborun::stages::MapView&,
                                     roborun::core::StageBudget&,
                                     roborun::stages::PlanResult&) noexcept override {
    return roborun::Status::kNoPath;
  }
};

// A fused multiply-add keeps the rounding error of the product; without one it is lost.
double error_of_product(volatile double a, volatile double b) {
  const double x = a, y = b;
  const double product = x * y;
  return x * y - product;
}

}  // namespace

int main() {
  const int shadowed = 1;
  {
    const int shadowed = 2;
    (void)shadowed;
  }  // no warning, no error
  const Nobody nobody;
  const roborun::stages::Planner& planner = nobody;
  roborun::governor::Governor governor{roborun::flight::governor_config({})};
  const auto decision = governor.decide({}, {});
  const bool ok = typeid(planner) == typeid(Nobody) && error_of_product(1.0 / 3.0, 3.3) == 0.0 &&
                  static_cast<char>(-1) < 0 && decision.point.deadline > roborun::Nanos{0} && shadowed == 1;
  std::puts(ok ? "same bits" : "other bits");
  return ok ? 0 : 1;
}
