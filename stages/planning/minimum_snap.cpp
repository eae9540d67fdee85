#include "stages/planning/minimum_snap.hpp"

#include <cmath>

#include "core/geometry/inverse.hpp"

namespace roborun::stages {
namespace {

using Matrix10 = Eigen::Matrix<double, 10, 10>;
using Rows = std::array<std::array<double, 3>, 4>;
/// L of L L^T: lower triangle; the diagonal inverted, so that nothing is divided later.
using Factor = std::array<std::array<double, 4>, 4>;

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

// The derivation, with q(tau) the segment on [0, 1], tau = t / T, and p^(d)(t) = T^-d q^(d)(tau):
//
//   integral of |p|^2 dt = T^-7 integral of |q|^2 dtau
//
// q has degree 9, so its ten coefficients c follow from value and derivatives 1 to 4 at both ends, y = A c,
// and the integral is c^T H c = y^T (A^-T H A^-1) y: a quadratic form Q that is the same for every segment.
// With y_d = T^d x_d for the derivative of order d, the product of derivatives of order d and e has the
// factor T^(d + e - 7), and the way w between the ends (a derivative of order 0) T^(d - 7).
//
// Half the gradient with respect to the derivatives at the beginning (b) and at the end (e) of one segment:
//   BB x_b + BE x_e + bw w        BE^T x_b + EE x_e + ew w
//
// At knot k the gradients of the segment before and of the one behind it add up to zero:
//   BE_(k-1)^T x_(k-1) + (EE_(k-1) + BB_k) x_k + BE_k x_(k+1) = -ew_(k-1) w_(k-1) - bw_k w_k
// which is symmetric, positive definite and block-tridiagonal, with D_k the block on the diagonal and r_k the
// right-hand side. Cholesky from the start on, knot by knot:
//   L_k L_k^T = D_k - C_(k-1)^T C_(k-1)     C_k = L_k^-1 BE_k     z_k = L_k^-1 (r_k - C_(k-1)^T z_(k-1))
// and from the end back:
//   x_k = L_k^-T (z_k - C_k x_(k+1))
// x_0 is the start state and x_n is rest: both are known, and move to the right-hand side.

/// Per knot, eliminated from the start on: L_k, C_k, and z_k, which becomes x_k.
struct MinimumSnap::Chain {
  std::array<Factor, kMaxKnots> factor;
  std::array<Block, kMaxKnots> coupling;
  std::array<Rows, kMaxKnots> x;
};

/// One segment of the chain.
struct MinimumSnap::Link {
  std::array<double, 9> power;  ///< T^(i - 7).
  std::array<double, 3> way;

  Link(const Vector3& from_W, const Vector3& to_W, double T) noexcept {
    const double T2 = T * T;
    power[0] = 1.0 / (T2 * T2 * T2 * T);
    for (std::size_t i = 1; i < power.size(); ++i) power[i] = power[i - 1] * T;
    for (std::size_t c = 0; c < 3; ++c) way[c] = (to_W - from_W)[static_cast<int>(c)];
  }
};

/// What a segment connects: positions, and derivatives 1 to 4 by axis.
struct MinimumSnap::Ends {
  const Vector3& from_W;
  const Vector3& to_W;
  const Rows& begin;
  const Rows& end;
};

/// The knot that is being put together: D_k and r_k.
struct MinimumSnap::Knot {
  Block diagonal;  ///< Lower triangle.
  Rows right;
};

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

/// Starts the knot at the end of a segment: D = EE, r = -ew w.
void MinimumSnap::begin_knot(const Link& link, Knot& knot) const noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j <= i; ++j) knot.diagonal[i][j] = end_end_[i][j] * link.power[i + j + 2];
    for (std::size_t c = 0; c < 3; ++c) knot.right[i][c] = -end_way_[i] * link.power[i + 1] * link.way[c];
  }
}

/// Takes the known state at the beginning of the first segment to the right-hand side: r -= BE^T x_0.
void MinimumSnap::subtract_start(const Link& link, const Rows& x0, Knot& knot) const noexcept {
  for (std::size_t m = 0; m < 4; ++m) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double factor_mi = begin_end_[m][i] * link.power[m + i + 2];
      for (std::size_t c = 0; c < 3; ++c) knot.right[i][c] -= factor_mi * x0[m][c];
    }
  }
}

/// Eliminates the knot before: D -= C^T C, r -= C^T z.
void MinimumSnap::subtract_before(const Block& coupling, const Rows& z, Knot& knot) noexcept {
  for (std::size_t m = 0; m < 4; ++m) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double factor_mi = coupling[m][i];
      for (std::size_t j = 0; j <= i; ++j) knot.diagonal[i][j] -= factor_mi * coupling[m][j];
      for (std::size_t c = 0; c < 3; ++c) knot.right[i][c] -= factor_mi * z[m][c];
    }
  }
}

/// Completes the knot at the beginning of a segment, D += BB, r -= bw w, and factors it: L, C, z.
void MinimumSnap::complete_knot(const Link& link, Knot& knot, std::size_t k, Chain& chain) const noexcept {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j <= i; ++j) knot.diagonal[i][j] += begin_begin_[i][j] * link.power[i + j + 2];
    for (std::size_t c = 0; c < 3; ++c) knot.right[i][c] -= begin_way_[i] * link.power[i + 1] * link.way[c];
    for (std::size_t j = 0; j < 4; ++j) chain.coupling[k][i][j] = begin_end_[i][j] * link.power[i + j + 2];
  }
  chain.factor[k] = cholesky(knot.diagonal);
  forward(chain.factor[k], chain.coupling[k]);
  chain.x[k] = knot.right;
  forward(chain.factor[k], chain.x[k]);
}

/// From the end back: x_k = L_k^-T (z_k - C_k x_(k+1)).
void MinimumSnap::substitute_back(std::size_t segments, Chain& chain) noexcept {
  for (std::size_t k = segments; k-- > 1;) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        for (std::size_t c = 0; c < 3; ++c)
          chain.x[k][i][c] -= chain.coupling[k][i][j] * chain.x[k + 1][j][c];
      }
    }
    backward(chain.factor[k], chain.x[k]);
  }
}

/// One axis of a segment from position and derivatives at its ends, `begin` and `end`. In tau, coefficients 0
/// to 4 are the derivatives at the beginning over factorials; coefficients 5 to 9 make up for what is left
/// open at the end: high = (A_high)^-1 rest, with rest_d = y_d(1) - sum_i i! / (i - d)! low_i. False if one is
/// not finite.
bool MinimumSnap::fill_axis(const Ends& ends, std::size_t c, PolynomialSegment& segment) const noexcept {
  constexpr std::array<double, 5> kPerFactorial{1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0};
  constexpr std::array<std::array<double, 5>, 5> kFalling{
      {{1, 1, 1, 1, 1}, {0, 1, 2, 3, 4}, {0, 0, 2, 6, 12}, {0, 0, 0, 6, 24}, {0, 0, 0, 0, 24}}};
  const auto axis = static_cast<int>(c);
  const double T = segment.duration_s;
  const double per_T = 1.0 / T;
  std::array<double, 5> low;   // coefficients 0 to 4 in tau, without the position itself
  std::array<double, 5> rest;  // what they leave open at the end
  low[0] = 0.0;
  rest[0] = ends.to_W[axis] - ends.from_W[axis];
  double power = T;
  for (std::size_t d = 1; d < 5; ++d, power *= T) {
    low[d] = power * ends.begin[d - 1][c] * kPerFactorial[d];
    rest[d] = power * ends.end[d - 1][c];
  }
  for (std::size_t d = 0; d < 5; ++d) {
    for (std::size_t i = d; i < 5; ++i) rest[d] -= kFalling[d][i] * low[i];
  }
  // Back to t: coefficient k is divided by T^k.
  segment.coefficient[0][axis] = ends.from_W[axis];
  power = per_T;
  for (std::size_t i = 1; i < 5; ++i, power *= per_T) segment.coefficient[i][axis] = power * low[i];
  bool finite = true;
  for (std::size_t i = 0; i < 5; ++i, power *= per_T) {
    double sum = 0.0;
    for (std::size_t d = 0; d < 5; ++d) sum += high_of_rest_[i][d] * rest[d];
    segment.coefficient[5 + i][axis] = power * sum;
    finite = finite && std::isfinite(sum * power);
  }
  return finite;
}

bool MinimumSnap::solve(std::span<const Vector3> knot_W, std::span<const double> time_s,
                        const TrajectoryPoint& start, Trajectory& out) const noexcept {
  if (knot_W.size() != time_s.size() || knot_W.size() < 2 || knot_W.size() > kMaxKnots) return false;
  const std::size_t segments = knot_W.size() - 1;
  Chain chain;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto axis = static_cast<int>(c);
    chain.x[0][0][c] = start.v_W[axis];
    chain.x[0][1][c] = start.a_W[axis];
    chain.x[0][2][c] = start.j_W[axis];
    chain.x[0][3][c] = 0.0;
    for (std::size_t i = 0; i < 4; ++i) chain.x[segments][i][c] = 0.0;
  }
  Knot knot;
  for (std::size_t k = 0; k < segments; ++k) {
    const Link link(knot_W[k], knot_W[k + 1], time_s[k + 1]);
    if (k > 0) complete_knot(link, knot, k, chain);
    if (k + 1 == segments) break;
    begin_knot(link, knot);
    if (k == 0) {
      subtract_start(link, chain.x[0], knot);
    } else {
      subtract_before(chain.coupling[k], chain.x[k], knot);
    }
  }
  substitute_back(segments, chain);

  out.segment_count = segments;
  bool finite = true;
  for (std::size_t k = 0; k < segments; ++k) {
    const Ends ends{knot_W[k], knot_W[k + 1], chain.x[k], chain.x[k + 1]};
    out.segment[k].duration_s = time_s[k + 1];
    for (std::size_t c = 0; c < 3; ++c) finite = fill_axis(ends, c, out.segment[k]) && finite;
  }
  return finite;
}

}  // namespace roborun::stages
