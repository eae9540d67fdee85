#include "governor/models/latency_model.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/geometry/inverse.hpp"

namespace roborun::governor {

double LatencyModel::latency_s(int level, double volume_m3) const noexcept {
  const auto i = static_cast<std::size_t>(std::clamp(level, 0, kPrecisionLevels - 1));
  return fixed_s[i] + slope_s_per_m3[i] * std::max(volume_m3, 0.0);
}

LatencyModel from_eq4(const Eq4& eq4) noexcept {
  LatencyModel model;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    const double r = 1.0 / cell_size_m(level);
    const auto i = static_cast<std::size_t>(level);
    model.fixed_s[i] = std::max(eq4.constant_s, 0.0);
    model.slope_s_per_m3[i] = std::max(((eq4.q[0] * r + eq4.q[1]) * r + eq4.q[2]) * r * eq4.q[3], 0.0);
  }
  return model;
}

LatencyModel from_cost(const core::StageCost& cost) noexcept { return {cost.fixed_s, cost.per_m3_s}; }

Eq4Fit fit_eq4(std::span<const LatencyPoint> points) noexcept {
  using Vector4 = Eigen::Vector4d;
  const auto row_of = [](const LatencyPoint& point) -> Vector4 {
    const double r = 1.0 / cell_size_m(point.level);
    return Vector4(r * r * r * point.volume_m3, r * r * point.volume_m3, r * point.volume_m3, 1.0) /
           point.latency_s;
  };
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Vector4 right = Vector4::Zero();
  double count = 0.0;
  for (const LatencyPoint& point : points) {
    if (!(point.latency_s > 0.0)) continue;
    const Vector4 row = row_of(point);
    normal += row * row.transpose();
    right += row;
    count += 1.0;
  }
  Eq4Fit best;
  double best_cost = 1e300;
  for (unsigned set = 1; set < 16; ++set) {
    // Scaled to unit diagonal: the features differ by ten orders of magnitude.
    Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
    Vector4 b = Vector4::Zero();
    Vector4 unit = Vector4::Ones();
    for (int i = 0; i < 4; ++i) unit[i] = normal(i, i) > 0.0 ? 1.0 / std::sqrt(normal(i, i)) : 1.0;
    for (int i = 0; i < 4; ++i) {
      if (((set >> static_cast<unsigned>(i)) & 1U) == 0) continue;
      b[i] = right[i] * unit[i];
      for (int k = 0; k < 4; ++k) {
        if (((set >> static_cast<unsigned>(k)) & 1U) != 0) A(i, k) = normal(i, k) * unit[i] * unit[k];
      }
    }
    const Vector4 scaled = core::inverse<4>(A) * b;
    const Vector4 x = scaled.cwiseProduct(unit);
    if (!x.allFinite() || x.minCoeff() < 0.0) continue;
    const double cost = count - 2.0 * right.dot(x) + x.dot(normal * x);
    if (cost < best_cost) {
      best_cost = cost;
      best.eq4 = {{x[0], x[1], x[2], 1.0}, x[3]};
    }
  }
  const LatencyModel model = from_eq4(best.eq4);
  for (const LatencyPoint& point : points) {
    if (!(point.latency_s > 0.0)) continue;
    const double error = std::fabs(model.latency_s(point.level, point.volume_m3) / point.latency_s - 1.0);
    best.mean_relative_error += error / count;
    best.max_relative_error = std::max(best.max_relative_error, error);
  }
  return best;
}

void DriftScale::observe(double predicted_s, double spent_s) noexcept {
  if (!(predicted_s > 0.0) || !(spent_s >= 0.0)) return;
  value_ = std::clamp(std::max(0.98 * value_, spent_s / predicted_s), 1.0, 4.0);
}

}  // namespace roborun::governor
