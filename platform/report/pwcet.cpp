#include "platform/report/pwcet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/random/counter_rng.hpp"

namespace roborun::report {
namespace {

constexpr std::size_t kFewest = 100;
constexpr double kIndependent = 1.96;
constexpr double kStationary = 1.36;
constexpr double kFits = 0.874;
constexpr std::size_t kRefits = 200;
constexpr double kEuler = 0.57721566490153286;

double runs_z(std::span<const double> x) {
  std::vector<double> sorted(x.begin(), x.end());
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  double above = 0, below = 0, runs = 0;
  int last = 0;
  for (const double v : x) {
    const int side = v > median ? 1 : (v < median ? -1 : 0);
    if (side == 0) continue;
    (side > 0 ? above : below) += 1;
    if (side != last) runs += 1;
    last = side;
  }
  const double n = above + below;
  if (above < 10 || below < 10) return 1e9;
  const double mean = 2 * above * below / n + 1;
  const double variance = (mean - 1) * (mean - 2) / (n - 1);
  return (runs - mean) / std::sqrt(variance);
}

double halves_ks(std::span<const double> x) {
  const std::size_t half = x.size() / 2;
  std::vector<double> a(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(half));
  std::vector<double> b(x.begin() + static_cast<std::ptrdiff_t>(half), x.end());
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  const auto na = static_cast<double>(a.size()), nb = static_cast<double>(b.size());
  double distance = 0;
  for (const double v : x) {
    const auto ca = static_cast<double>(std::upper_bound(a.begin(), a.end(), v) - a.begin());
    const auto cb = static_cast<double>(std::upper_bound(b.begin(), b.end(), v) - b.begin());
    distance = std::max(distance, std::abs(ca / na - cb / nb));
  }
  return distance * std::sqrt(na * nb / (na + nb));
}

struct Gumbel {
  double location{}, scale{};
  [[nodiscard]] double level(double reduced) const { return location + scale * reduced; }
};

/// By probability-weighted moments. `x` ascending.
Gumbel fit_gumbel(std::span<const double> x) {
  const auto count = static_cast<double>(x.size());
  double b0 = 0, b1 = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    b0 += x[i] / count;
    b1 += x[i] * static_cast<double>(i) / (count - 1) / count;
  }
  const double scale = (2 * b1 - b0) / std::log(2.0);
  return {b0 - kEuler * scale, scale};
}

double reduced_of(double probability) { return -std::log(-std::log(probability)); }

/// Fits to samples as large as ours, drawn from our fit: how much the fit owes to chance.
std::vector<Gumbel> refits(const Gumbel& fit, std::size_t count) {
  core::CounterRng rng(1, count);
  std::vector<Gumbel> all;
  std::vector<double> x(count);
  for (std::size_t i = 0; i < kRefits; ++i) {
    for (double& v : x) v = fit.level(reduced_of(std::clamp(rng.uniform(), 1e-12, 1.0 - 1e-12)));
    std::sort(x.begin(), x.end());
    all.push_back(fit_gumbel(x));
  }
  return all;
}

ReturnLevel level_at(double reduced, const Gumbel& fit, const std::vector<Gumbel>& again) {
  std::vector<double> levels;
  levels.reserve(again.size());
  for (const Gumbel& g : again) levels.push_back(g.level(reduced));
  std::sort(levels.begin(), levels.end());
  return {reduced, fit.level(reduced), levels[kRefits / 40], levels[kRefits - 1 - kRefits / 40]};
}

/// `x` ascending.
void fill_levels(std::span<const double> x, Pwcet& out) {
  const Gumbel fit{out.location_us, out.scale_us};
  for (std::size_t i = 0; i < x.size(); ++i)
    out.observed_us.emplace_back(reduced_of(static_cast<double>(i + 1) / static_cast<double>(x.size() + 1)),
                                 x[i]);
  const std::vector<Gumbel> again = refits(fit, x.size());
  const double last = std::log(1e9);
  const double first = out.observed_us.front().first;
  constexpr int kPoints = 40;
  for (int i = 0; i <= kPoints; ++i)
    out.levels.push_back(level_at(first + (last - first) * i / kPoints, fit, again));
  out.exceeded_1e9_us = out.levels.back().level_us;
  out.exceeded_1e9_low_us = out.levels.back().low_us;
  out.exceeded_1e9_high_us = out.levels.back().high_us;
}

}  // namespace

Pwcet fit_pwcet(std::span<const double> maximum_us) {
  Pwcet out;
  const std::size_t n = maximum_us.size();
  if (n < kFewest) {
    out.verdict = fmt::format("refused: {} blocks, {} are needed", n, kFewest);
    return out;
  }
  out.independence_z = runs_z(maximum_us);
  out.stationarity_ks = halves_ks(maximum_us);
  std::vector<double> x(maximum_us.begin(), maximum_us.end());
  std::sort(x.begin(), x.end());
  const auto count = static_cast<double>(n);
  const Gumbel fit = fit_gumbel(x);
  out.scale_us = fit.scale;
  out.location_us = fit.location;
  if (!(out.scale_us > 0.0)) {
    out.verdict = "refused: all blocks are equal";
    return out;
  }
  double distance = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double f = std::exp(-std::exp(-(x[i] - out.location_us) / out.scale_us));
    distance = std::max({distance, std::abs(static_cast<double>(i + 1) / count - f),
                         std::abs(static_cast<double>(i) / count - f)});
  }
  out.fit_ks = distance * std::sqrt(count);
  if (std::abs(out.independence_z) > kIndependent)
    out.verdict =
        fmt::format("refused: blocks are not independent (runs test z = {:.1f})", out.independence_z);
  else if (out.stationarity_ks > kStationary)
    out.verdict = fmt::format("refused: not stationary (halves differ by {:.2f})", out.stationarity_ks);
  else if (out.fit_ks > kFits)
    out.verdict = fmt::format("refused: no Gumbel distribution (distance {:.2f})", out.fit_ks);
  else {
    out.fitted = true;
    out.verdict = "supporting evidence";
    fill_levels(x, out);
  }
  return out;
}

}  // namespace roborun::report
