#include "platform/live/earth_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/math.hpp"

namespace roborun::live {
namespace {

constexpr int kDegrees = 4;
struct Term {
  int n, m;
  double g_nT, h_nT;
};
constexpr std::array<Term, 14> kTerms{{{1, 0, -29404.8, 0.0},
                                       {1, 1, -1450.9, 4652.5},
                                       {2, 0, -2499.6, 0.0},
                                       {2, 1, 2982.0, -2991.6},
                                       {2, 2, 1677.0, -734.6},
                                       {3, 0, 1363.2, 0.0},
                                       {3, 1, -2381.2, -82.1},
                                       {3, 2, 1236.2, 241.9},
                                       {3, 3, 525.7, -543.4},
                                       {4, 0, 903.0, 0.0},
                                       {4, 1, 809.5, 281.9},
                                       {4, 2, 86.3, -158.4},
                                       {4, 3, -309.4, 199.7},
                                       {4, 4, 48.0, -349.7}}};

/// P_n^m(cos theta) and its derivative by theta.
class Legendre {
 public:
  Legendre(double cosine, double sine) {
    at(0, 0) = {1.0, 0.0};
    for (int n = 1; n <= kDegrees; ++n) {
      const double last = 2.0 * n - 1.0;
      for (int m = 0; m < n; ++m) {
        const Value one = at(n - 1, m), two = n - 2 >= m ? at(n - 2, m) : Value{};
        const double a = std::sqrt(static_cast<double>((n - 1) * (n - 1) - m * m));
        const double b = std::sqrt(static_cast<double>(n * n - m * m));
        at(n, m) = {(last * cosine * one.p - a * two.p) / b,
                    (last * (cosine * one.slope - sine * one.p) - a * two.slope) / b};
      }
      const Value one = at(n - 1, n - 1);
      const double k = n == 1 ? 1.0 : std::sqrt(last / (2.0 * n));
      at(n, n) = {k * sine * one.p, k * (sine * one.slope + cosine * one.p)};
    }
  }
  struct Value {
    double p{}, slope{};
  };
  [[nodiscard]] const Value& operator()(int n, int m) const { return value_.at(index(n, m)); }

 private:
  static constexpr std::size_t kOrders = kDegrees + 1;
  static std::size_t index(int n, int m) {
    return static_cast<std::size_t>(n) * kOrders + static_cast<std::size_t>(m);
  }
  Value& at(int n, int m) { return value_.at(index(n, m)); }
  std::array<Value, kOrders * kOrders> value_{};
};

}  // namespace

Vector3 earth_field_gauss(double latitude_deg, double longitude_deg) {
  constexpr double kNearPole = 1e-6;
  constexpr double kGauss_nT = 1e5;
  const double from_pole_rad = (90.0 - latitude_deg) * core::kDegree,
               east_rad = longitude_deg * core::kDegree;
  const double sine = std::max(std::sin(from_pole_rad), kNearPole);
  const Legendre legendre(std::cos(from_pole_rad), sine);
  Vector3 field_nT = Vector3::Zero();
  for (const Term& t : kTerms) {
    const double c = std::cos(t.m * east_rad), s = std::sin(t.m * east_rad);
    const double along = t.g_nT * c + t.h_nT * s;
    field_nT.x() += t.m * (t.g_nT * s - t.h_nT * c) * legendre(t.n, t.m).p / sine;
    field_nT.y() += along * legendre(t.n, t.m).slope;
    field_nT.z() += (t.n + 1) * along * legendre(t.n, t.m).p;
  }
  return field_nT / kGauss_nT;
}

}  // namespace roborun::live
