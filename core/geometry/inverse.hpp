/// The inverse of a small matrix without the heap paths of general libraries.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace roborun::core {

/// Gauss-Jordan with row pivoting. A singular matrix gives non-finite entries, which callers check. RT-safe:
/// O(N^3).
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, N> inverse(Eigen::Matrix<double, N, N> a) noexcept {
  Eigen::Matrix<double, N, N> result = Eigen::Matrix<double, N, N>::Identity();
  for (int column = 0; column < N; ++column) {
    int pivot = column;
    for (int row = column + 1; row < N; ++row) {
      if (std::fabs(a(row, column)) > std::fabs(a(pivot, column))) pivot = row;
    }
    if (pivot != column) {
      a.row(pivot).swap(a.row(column));
      result.row(pivot).swap(result.row(column));
    }
    const double scale = 1.0 / a(column, column);
    a.row(column) *= scale;
    result.row(column) *= scale;
    for (int row = 0; row < N; ++row) {
      if (row == column) continue;
      const double factor = a(row, column);
      a.row(row) -= factor * a.row(column);
      result.row(row) -= factor * result.row(column);
    }
  }
  return result;
}

}  // namespace roborun::core
