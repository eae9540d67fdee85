/// A probabilistic worst-case execution time by extreme-value statistics, or the reason why there is none.
/// Supporting evidence only: it extrapolates what was measured, and knows nothing of paths that never ran.
/// Source: Cucu-Grosjean et al., "Measurement-based probabilistic timing analysis for multi-path programs"
/// (2012).
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

namespace roborun::report {

/// Of the fitted distribution, where a block's maximum lies below it with probability exp(-exp(-reduced)).
struct ReturnLevel {
  double reduced{};
  double level_us{};
  double low_us{}, high_us{};  ///< 95 % of 200 fits to samples drawn from the fit (parametric bootstrap).
};

struct Pwcet {
  bool fitted{false};
  std::string verdict;   ///< Why it was refused, or "supporting evidence".
  double location_us{};  ///< Gumbel, by probability-weighted moments.
  double scale_us{};
  double exceeded_1e9_us{};  ///< Exceeded by one block in 1e9, if the fit holds.
  double exceeded_1e9_low_us{},
      exceeded_1e9_high_us{};  ///< Its 95 % band: of the fit's noise, not of its model.
  double independence_z{};     ///< Wald-Wolfowitz runs test about the median.
  double
      stationarity_ks{};  ///< Kolmogorov-Smirnov distance of the two halves, times sqrt(n1 n2 / (n1 + n2)).
  double fit_ks{};        ///< The same of sample against Gumbel, times sqrt(n).
  // For the return-level plot of a fit that was not refused.
  std::vector<std::pair<double, double>> observed_us;  ///< (reduced, maximum) of every block.
  std::vector<ReturnLevel> levels;                     ///< Up to one block in 1e9.
};

/// `maximum_us`: of equally long blocks, in order. Refuses fewer than 100 blocks, |z| > 1.96 (not
/// independent), a distance of halves above 1.36 (not stationary), a fit worse than 0.874 (5 % of Gumbel
/// samples with fitted parameters, Stephens 1977, are worse), and blocks that are all equal.
[[nodiscard]] Pwcet fit_pwcet(std::span<const double> maximum_us);

}  // namespace roborun::report
