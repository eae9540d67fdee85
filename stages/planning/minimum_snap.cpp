#include "stages/planning/minimum_snap.hpp"

#include <cmath>

#include "core/geometry/inverse.hpp"

namespace roborun::stages {
namespace {

using Matrix10 = Eigen::Matrix<double, 10, 10>;
/// Right-hand sides and unknowns of one knot: derivative 1 to 4 by axis.
using Rows = std::array<std::array<double, 3>, 4>;
using Factor = std::array<std::array<double, 4>, 4>;  // lower triangle; the diagonal inverted

/// k! / (k - d)!
double falling(int k, int d) noexcept {
  double product = 1.0;
  for (int i = 0; i < d; ++i) product *= k - i;
  return product;
}

Factor cholesky(const std::array<std::array<double, 4>, 4>& a) noexcept {
  Factor l;
  for (std::size_t j = 0; j < 4; ++j) {
    double pivot = a[j][j];
    for (std::size_t k = 0; k < j; ++k) pivot -= l[j][k] * l[j][k];
    l[j][j] = 1.0 / std::sqrt(pivot);
    for (std::size_t i = j + 1; i < 4; ++i) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
      l[i][j] = sum * l[j][j];
    }
  }
  return l;
}

/// rows = L^-1 rows
template <std::size_t Columns>
void forward(const Factor& l, std::array<std::array<double, Columns>, 4>& rows) noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      for (std::size_t c = 0; c < Columns; ++c) rows[i][c] -= l[i][k] * rows[k][c];
    }
    for (std::size_t c = 0; c < Columns; ++c) rows[i][c] *= l[i][i];
  }
}

/// rows = L^-T rows
void backward(const Factor& l, Rows& rows) noexcept {
  for (std::size_t i = 4; i-- > 0;) {
    for (std::size_t k = i + 1; k < 4; ++k) {
      for (std::size_t c = 0; c < 3; ++c) rows[i][c] -= l[k][i] * rows[k][c];
    }
    for (std::size_t c = 0; c < 3; ++c) rows[i][c] *= l[i][i];
  }
}

}  // namespace

MinimumSnap::MinimumSnap() noexcept {
  Matrix10 ends = Matrix10::Zero();  // value and four derivatives at 0 and at 1, of the coefficients
  Matrix10 hessian = Matrix10::Zero();
  Eigen::Matrix<double, 5, 5> high;
  for (int d = 0; d < 5; ++d) {
    ends(d, d) = falling(d, d);
    for (int k = d; k < 10; ++k) ends(5 + d, k) = falling(k, d);
    for (int k = 5; k < 10; ++k) high(d, k - 5) = falling(k, d);
  }
  for (int i = 4; i < 10; ++i) {
    for (int k = 4; k < 10; ++k) hessian(i, k) = falling(i, 4) * falling(k, 4) / (i + k - 7);
  }
  const Matrix10 coefficient_of_ends = core::inverse<10>(ends);
  const Matrix10 half = hessian.lazyProduct(coefficient_of_ends);
  const Matrix10 cost = coefficient_of_ends.transpose().lazyProduct(half);
  const Eigen::Matrix<double, 5, 5> high_of_rest = core::inverse<5>(high);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto row = static_cast<int>(i);
    for (std::size_t k = 0; k < 4; ++k) {
      const auto column = static_cast<int>(k);
      begin_begin_[i][k] = cost(1 + row, 1 + column);
      begin_end_[i][k] = cost(1 + row, 6 + column);
      end_end_[i][k] = cost(6 + row, 6 + column);
    }
    // A constant has no snap: what the position at the end does, that at the beginning undoes.
    begin_way_[i] = cost(1 + row, 5);
    end_way_[i] = cost(6 + row, 5);
  }
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 5; ++k)
      high_of_rest_[i][k] = high_of_rest(static_cast<int>(i), static_cast<int>(k));
  }
}

bool MinimumSnap::solve(std::span<const Vector3> knot_W, std::span<const double> time_s,
                        const TrajectoryPoint& start, Trajectory& out) const noexcept {
  if (knot_W.size() != time_s.size() || knot_W.size() < 2 || knot_W.size() > kMaxKnots) return false;
  const std::size_t segments = knot_W.size() - 1;
  // Eliminated from the start on: of each knot its factor, its coupling to the next one and its right-hand
  // side.
  std::array<Factor, kMaxKnots> factor;
  std::array<Block, kMaxKnots> coupling;
  std::array<Rows, kMaxKnots> x;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto axis = static_cast<int>(c);
    x[0][0][c] = start.v_W[axis];
    x[0][1][c] = start.a_W[axis];
    x[0][2][c] = start.j_W[axis];
    x[0][3][c] = 0.0;
    for (std::size_t i = 0; i < 4; ++i) x[segments][i][c] = 0.0;
  }
  Block diagonal;
  Rows right;
  for (std::size_t k = 0; k < segments; ++k) {
    const double T = time_s[k + 1];
    std::array<double, 9> power;  // T^(i - 7): a term with derivatives of order d and e has T^(d + e - 7)
    const double T2 = T * T;
    power[0] = 1.0 / (T2 * T2 * T2 * T);
    for (std::size_t i = 1; i < power.size(); ++i) power[i] = power[i - 1] * T;
    std::array<double, 3> way;
    for (std::size_t c = 0; c < 3; ++c) way[c] = (knot_W[k + 1] - knot_W[k])[static_cast<int>(c)];

    if (k > 0) {
      // What this segment adds to the knot at its beginning, which is then complete.
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = 0; j <= i; ++j) diagonal[i][j] += begin_begin_[i][j] * power[i + j + 2];
        for (std::size_t c = 0; c < 3; ++c) right[i][c] -= begin_way_[i] * power[i + 1] * way[c];
        for (std::size_t j = 0; j < 4; ++j) coupling[k][i][j] = begin_end_[i][j] * power[i + j + 2];
      }
      factor[k] = cholesky(diagonal);
      forward(factor[k], coupling[k]);
      x[k] = right;
      forward(factor[k], x[k]);
    }
    if (k + 1 == segments) break;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) diagonal[i][j] = end_end_[i][j] * power[i + j + 2];
      for (std::size_t c = 0; c < 3; ++c) right[i][c] = -end_way_[i] * power[i + 1] * way[c];
    }
    for (std::size_t m = 0; m < 4; ++m) {
      for (std::size_t i = 0; i < 4; ++i) {
        if (k == 0) {
          const double factor_mi = begin_end_[m][i] * power[m + i + 2];
          for (std::size_t c = 0; c < 3; ++c) right[i][c] -= factor_mi * x[0][m][c];
          continue;
        }
        const double factor_mi = coupling[k][m][i];
        for (std::size_t j = 0; j <= i; ++j) diagonal[i][j] -= factor_mi * coupling[k][m][j];
        for (std::size_t c = 0; c < 3; ++c) right[i][c] -= factor_mi * x[k][m][c];
      }
    }
  }
  for (std::size_t k = segments; k-- > 1;) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        for (std::size_t c = 0; c < 3; ++c) x[k][i][c] -= coupling[k][i][j] * x[k + 1][j][c];
      }
    }
    backward(factor[k], x[k]);
  }

  out.segment_count = segments;
  bool finite = true;
  for (std::size_t k = 0; k < segments; ++k) {
    const double T = time_s[k + 1];
    const double per_T = 1.0 / T;
    constexpr std::array<double, 5> kPerFactorial{1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0};
    constexpr std::array<std::array<double, 5>, 5> kFalling{
        {{1, 1, 1, 1, 1}, {0, 1, 2, 3, 4}, {0, 0, 2, 6, 12}, {0, 0, 0, 6, 24}, {0, 0, 0, 0, 24}}};
    PolynomialSegment& segment = out.segment[k];
    segment.duration_s = T;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto axis = static_cast<int>(c);
      std::array<double, 5> low;   // coefficients 0 to 4, in units of the duration
      std::array<double, 5> rest;  // what they leave open at the end
      low[0] = 0.0;
      rest[0] = knot_W[k + 1][axis] - knot_W[k][axis];
      double power = T;
      for (std::size_t d = 1; d < 5; ++d, power *= T) {
        low[d] = power * x[k][d - 1][c] * kPerFactorial[d];
        rest[d] = power * x[k + 1][d - 1][c];
      }
      for (std::size_t d = 0; d < 5; ++d) {
        for (std::size_t i = d; i < 5; ++i) rest[d] -= kFalling[d][i] * low[i];
      }
      segment.coefficient[0][axis] = knot_W[k][axis];
      power = per_T;
      for (std::size_t i = 1; i < 5; ++i, power *= per_T) segment.coefficient[i][axis] = power * low[i];
      for (std::size_t i = 0; i < 5; ++i, power *= per_T) {
        double sum = 0.0;
        for (std::size_t d = 0; d < 5; ++d) sum += high_of_rest_[i][d] * rest[d];
        segment.coefficient[5 + i][axis] = power * sum;
        finite = finite && std::isfinite(sum * power);
      }
    }
  }
  return finite;
}

}  // namespace roborun::stages
