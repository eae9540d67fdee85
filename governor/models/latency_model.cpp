#include "governor/models/latency_model.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/inverse.hpp"

namespace roborun::governor {

Status LatencyModel::validate() const noexcept {
  bool ok = true;
  for (const double s : fixed_s) ok = ok && std::isfinite(s) && s >= 0.0;
  for (const double s : slope_s_per_m3) ok = ok && std::isfinite(s) && s >= 0.0;
  return ok ? Status::kOk : Status::kInvalidArgument;
}

LatencyModel slower(const LatencyModel& model, double factor) noexcept {
  LatencyModel result = model;
  for (double& s : result.fixed_s) s *= factor;
  for (double& s : result.slope_s_per_m3) s *= factor;
  return result;
}

double LatencyModel::latency_s(int level, double volume_m3) const noexcept {
  const auto i = static_cast<std::size_t>(std::clamp(level, 0, kPrecisionLevels - 1));
  return fixed_s[i] + slope_s_per_m3[i] * std::max(volume_m3, 0.0);
}

LatencyModel from_eq4(const Eq4& eq4, double finest_m) noexcept {
  LatencyModel model;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    const double r = 1.0 / (finest_m * static_cast<double>(1 << level));
    const auto i = static_cast<std::size_t>(level);
    model.slope_s_per_m3[i] = std::max(((eq4.q[0] * r + eq4.q[1]) * r + eq4.q[2]) * r * eq4.q[3], 0.0);
  }
  return model;
}

LatencyModel from_cost(const core::StageCost& cost) noexcept { return {cost.fixed_s, cost.per_m3_s}; }

LatencyModel fit_latency(std::span<const LatencyPoint> points) noexcept {
  constexpr int kVolumeTerms = 4;  // volume times r^3, r^2, r, 1
  constexpr int kTerms = kVolumeTerms + kPrecisionLevels;
  using Terms = Eigen::Matrix<double, kTerms, 1>;
  using Normal = Eigen::Matrix<double, kTerms, kTerms>;
  // Term 4 + k is a constant of levels 0 .. k: steps >= 0 make the constants fall with the level.
  const auto terms_of = [](int level, double volume_m3) -> Terms {
    const double r = 1.0 / PrecisionLattice{}.cell_size_m(level);
    Terms row = Terms::Zero();
    row.head<kVolumeTerms>() << r * r * r * volume_m3, r * r * volume_m3, r * volume_m3, volume_m3;
    for (int k = level; k < kPrecisionLevels; ++k) row[kVolumeTerms + k] = 1.0;
    return row;
  };
  Normal normal = Normal::Zero();
  Terms right = Terms::Zero();
  double count = 0.0;
  for (const LatencyPoint& point : points) {
    if (!(point.latency_s > 0.0)) continue;
    const Terms row = terms_of(point.level, point.volume_m3) / point.latency_s;
    normal += row * row.transpose();
    right += row;
    count += 1.0;
  }
  Terms best = Terms::Zero();
  double best_cost = std::numeric_limits<double>::infinity();
  for (unsigned set = 1; set < (1U << kTerms); ++set) {
    // Scaled to unit diagonal: the features differ by ten orders of magnitude.
    Normal A = Normal::Identity();
    Terms b = Terms::Zero();
    Terms unit = Terms::Ones();
    for (int i = 0; i < kTerms; ++i) unit[i] = normal(i, i) > 0.0 ? 1.0 / std::sqrt(normal(i, i)) : 1.0;
    for (int i = 0; i < kTerms; ++i) {
      if (((set >> static_cast<unsigned>(i)) & 1U) == 0) continue;
      b[i] = right[i] * unit[i];
      for (int k = 0; k < kTerms; ++k) {
        if (((set >> static_cast<unsigned>(k)) & 1U) != 0) A(i, k) = normal(i, k) * unit[i] * unit[k];
      }
    }
    const Terms scaled = core::inverse<kTerms>(A).lazyProduct(b);
    const Terms x = scaled.cwiseProduct(unit);
    if (!x.allFinite() || x.minCoeff() < 0.0) continue;
    const Terms normal_x = normal.lazyProduct(x);
    const double cost = count - 2.0 * right.dot(x) + x.dot(normal_x);
    if (cost < best_cost) {
      best_cost = cost;
      best = x;
    }
  }
  LatencyModel model;
  for (int level = 0; level < kPrecisionLevels; ++level) {
    const auto i = static_cast<std::size_t>(level);
    const Terms terms = terms_of(level, 1.0);
    model.slope_s_per_m3[i] = terms.head<kVolumeTerms>().dot(best.head<kVolumeTerms>());
    model.fixed_s[i] = terms.tail<kPrecisionLevels>().dot(best.tail<kPrecisionLevels>());
  }
  return model;
}

ModelError error_of(const LatencyModel& model, std::span<const LatencyPoint> points) noexcept {
  ModelError error;
  double count = 0.0;
  for (const LatencyPoint& point : points) {
    if (!(point.latency_s > 0.0)) continue;
    const double relative = std::fabs(model.latency_s(point.level, point.volume_m3) / point.latency_s - 1.0);
    error.mean_relative += relative;
    error.max_relative = std::max(error.max_relative, relative);
    count += 1.0;
  }
  if (count > 0.0) error.mean_relative /= count;
  return error;
}

void DriftScale::observe(double predicted_s, double spent_s) noexcept {
  if (!(predicted_s > 0.0) || !(spent_s >= 0.0)) return;
  value_ = std::clamp(std::max(0.98 * value_, spent_s / predicted_s), 1.0, 4.0);
}

}  // namespace roborun::governor
