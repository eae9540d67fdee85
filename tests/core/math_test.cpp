#include "core/geometry/math.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/geometry/inverse.hpp"
#include "core/random/counter_rng.hpp"
#include "tests/support/limits.hpp"

namespace roborun::core {
namespace {

using test::kInfinity;
using test::kNan;

TEST(Math, SineAndCosineAgreeWithLibm) {
  CounterRng rng(1);
  for (int i = 0; i < 200000; ++i) {
    const double x = rng.uniform(-1e5, 1e5);
    ASSERT_NEAR(sin(x), std::sin(x), 1e-11) << x;
    ASSERT_NEAR(cos(x), std::cos(x), 1e-11) << x;
    const double small = rng.uniform(-10.0, 10.0);
    ASSERT_NEAR(sin(small), std::sin(small), 1e-14) << small;
    ASSERT_NEAR(cos(small), std::cos(small), 1e-14) << small;
  }
  EXPECT_TRUE(std::isnan(sin(kNan)));
  EXPECT_TRUE(std::isnan(cos(kInfinity)));
}

TEST(Math, ArcFunctionsAgreeWithLibm) {
  CounterRng rng(2);
  for (int i = 0; i < 200000; ++i) {
    const double y = rng.uniform(-5.0, 5.0);
    const double x = rng.uniform(-5.0, 5.0);
    ASSERT_NEAR(atan2(y, x), std::atan2(y, x), 1e-14);
    const double c = rng.uniform(-1.0, 1.0);
    ASSERT_NEAR(asin(c), std::asin(c), 1e-13);
    ASSERT_NEAR(acos(c), std::acos(c), 1e-13);
  }
  EXPECT_EQ(atan2(0.0, 0.0), 0.0);
  EXPECT_NEAR(atan2(0.0, -1.0), kPi, 1e-15);
  EXPECT_NEAR(acos(1.0 + 1e-12), 0.0, 1e-12) << "clamped";
  EXPECT_TRUE(std::isnan(atan2(kNan, 1.0)));
}

TEST(Math, ExponentialAndLogarithmAgreeWithLibm) {
  CounterRng rng(3);
  for (int i = 0; i < 200000; ++i) {
    const double x = rng.uniform(-700.0, 700.0);
    ASSERT_NEAR(exp(x) / std::exp(x), 1.0, 1e-13) << x;
    const double y = std::exp(rng.uniform(-700.0, 700.0));
    ASSERT_NEAR(log(y), std::log(y), 1e-13 * std::fmax(1.0, std::fabs(std::log(y)))) << y;
  }
  EXPECT_EQ(exp(1000.0), kInfinity);
  EXPECT_EQ(exp(-1000.0), 0.0);
  EXPECT_EQ(log(0.0), -kInfinity);
  EXPECT_TRUE(std::isnan(log(-1.0)));
  EXPECT_NEAR(log(5e-320), std::log(5e-320), 1e-9) << "below the normal range";
}

TEST(Math, WrapsAnglesIntoOneTurn) {
  for (int i = -50; i <= 50; ++i) {
    const double wrapped = wrap_angle(0.3 + 2.0 * kPi * i);
    EXPECT_NEAR(wrapped, 0.3, 1e-12);
  }
}

TEST(Inverse, TimesTheMatrixIsIdentity) {
  CounterRng rng(4);
  for (int n = 0; n < 200; ++n) {
    Eigen::Matrix<double, 6, 6> a;
    for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = rng.uniform(-1.0, 1.0);
    const Eigen::Matrix<double, 6, 6> product = inverse<6>(a) * a;
    ASSERT_NEAR((product - Eigen::Matrix<double, 6, 6>::Identity()).cwiseAbs().maxCoeff(), 0.0, 1e-8);
  }
}

TEST(CounterRng, HasTheMomentsOfItsDistributions) {
  CounterRng rng(5);
  double sum = 0.0, square = 0.0, normal_sum = 0.0, normal_square = 0.0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double u = rng.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    sum += u;
    square += u * u;
    const double z = rng.normal();
    normal_sum += z;
    normal_square += z * z;
  }
  // Standard errors: 0.29 / sqrt(2e5) = 6.5e-4 and 1 / sqrt(2e5) = 2.2e-3; six of them.
  EXPECT_NEAR(sum / kCount, 0.5, 0.004);
  EXPECT_NEAR(square / kCount, 1.0 / 3.0, 0.004);
  EXPECT_NEAR(normal_sum / kCount, 0.0, 0.014);
  EXPECT_NEAR(normal_square / kCount, 1.0, 0.02);
}

TEST(CounterRng, GivesTheSameNumbersAgainAndOtherOnesForOtherStreams) {
  CounterRng a(7, 1), b(7, 1), c(7, 2), d(8, 1);
  const std::uint64_t first = a.next();
  EXPECT_EQ(first, b.next());
  EXPECT_NE(first, c.next());
  EXPECT_NE(first, d.next());
  a.seek(0);
  EXPECT_EQ(first, a.next());
}

TEST(CounterRng, IsFixedForEver) {
  // A changed generator changes every stored hash. Values of an independent implementation.
  EXPECT_EQ(CounterRng(1).next(), 0x21a5715431dc4cc7ULL);
  EXPECT_EQ(CounterRng(9).below(1'000'000'000'000'000'000ULL), 213095797923299207ULL);
  CounterRng rng(42, 3);
  std::uint64_t mixed = 0;
  for (std::uint64_t i = 0; i < 1000; ++i) mixed ^= mix64(rng.next() + i);
  EXPECT_EQ(mixed, 0x2af8f49f571019aULL);
}

TEST(CounterRng, MultipliesWithoutAWideTypeAsWithOne) {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  EXPECT_EQ(multiply_high(kMost, kMost), kMost - 1);  // (2^64 - 1)^2 = 2^128 - 2^65 + 1
  EXPECT_EQ(multiply_high(kMost, 1), 0U);
  EXPECT_EQ(multiply_high(1ULL << 63U, 2), 1U);
#ifdef __SIZEOF_INT128__
  __extension__ using Wide = unsigned __int128;
  CounterRng rng(11);
  for (int i = 0; i < 1'000'000; ++i) {
    // Of all sizes: carries are rare between large random factors.
    const std::uint64_t a = rng.next() >> (rng.next() % 64U);
    const std::uint64_t b = rng.next() >> (rng.next() % 64U);
    ASSERT_EQ(multiply_high(a, b), static_cast<std::uint64_t>((static_cast<Wide>(a) * b) >> 64U))
        << a << ' ' << b;
  }
#endif
}

TEST(CounterRng, StaysBelowItsBound) {
  CounterRng rng(9);
  std::array<int, 7> seen{};
  for (int i = 0; i < 7000; ++i) ++seen[static_cast<std::size_t>(rng.below(7))];
  for (const int count : seen) EXPECT_NEAR(count, 1000, 200);
  EXPECT_EQ(rng.below(0), 0U);
}

}  // namespace
}  // namespace roborun::core
