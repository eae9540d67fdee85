#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

#include "core/memory/arena.hpp"
#include "core/memory/static_vector.hpp"
#include "core/precision.hpp"
#include "core/record/state_hash.hpp"
#include "firmware_if/status.hpp"
#include "firmware_if/time.hpp"
#include "tests/support/no_alloc_scope.hpp"

namespace roborun::core {
namespace {

TEST(Arena, HandsOutAlignedMemoryUntilItIsFull) {
  alignas(64) std::array<std::byte, 256> block{};
  Arena sut(block);
  const auto one = sut.take<char>(1);
  const auto doubles = sut.take<double>(10);
  ASSERT_EQ(one.size(), 1U);
  ASSERT_EQ(doubles.size(), 10U);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(doubles.data()) % alignof(double), 0U);
  EXPECT_EQ(doubles[9], 0.0);
  EXPECT_FALSE(sut.exhausted());
  EXPECT_TRUE(sut.take<double>(1000).empty());
  EXPECT_TRUE(sut.exhausted());
  EXPECT_EQ(sut.take<char>(8).size(), 8U) << "a refused request takes nothing";
}

TEST(Arena, FindsAPoolByItsName) {
  std::array<std::byte, 256> block{};
  Arena sut(block);
  EXPECT_EQ(sut.find("bricks"), nullptr);
  ASSERT_EQ(sut.take<double>(4, "bricks").size(), 4U);
  ASSERT_NE(sut.find("bricks"), nullptr);
  EXPECT_EQ(sut.find("bricks")->count, 4U);
  EXPECT_EQ(sut.find("nodes"), nullptr);
}

TEST(Arena, RefusesCountsThatOverflow) {
  std::array<std::byte, 64> block{};
  Arena sut(block);
  EXPECT_TRUE(sut.take<double>(std::numeric_limits<std::size_t>::max() / 4).empty());
}

TEST(StaticVector, RefusesWhatDoesNotFit) {
  StaticVector<int, 3> sut;
  EXPECT_TRUE(sut.push_back(1) && sut.push_back(2) && sut.push_back(3));
  EXPECT_FALSE(sut.push_back(4));
  EXPECT_EQ(sut.size(), 3U);
  EXPECT_EQ(sut.back(), 3);
}

TEST(Precision, DoublesFromTheFinestCell) {
  EXPECT_DOUBLE_EQ(PrecisionLattice{}.cell_size_m(0), 0.3);
  EXPECT_DOUBLE_EQ(PrecisionLattice{}.cell_size_m(5), 9.6);
  EXPECT_DOUBLE_EQ(PrecisionLattice{}.cell_size_m(99), 9.6);
  EXPECT_EQ(PrecisionLattice{}.coarsest_level_within(0.1), 0);
  EXPECT_EQ(PrecisionLattice{}.coarsest_level_within(1.2), 2);
  EXPECT_EQ(PrecisionLattice{}.coarsest_level_within(1.19), 1);
  EXPECT_EQ(PrecisionLattice{}.coarsest_level_within(std::numeric_limits<double>::infinity()), 5);
  EXPECT_EQ(PrecisionLattice{}.coarsest_level_within(std::numeric_limits<double>::quiet_NaN()), 0);
  constexpr PrecisionLattice kHalf{0.15};
  EXPECT_DOUBLE_EQ(kHalf.cell_size_m(5), 4.8);
  EXPECT_EQ(kHalf.coarsest_level_within(1.2), 3);
}

TEST(StateHash, IsBlindToTheKindsOfNanAndZero) {
  StateHash a, b, c;
  a.add(0.0);
  b.add(-0.0);
  EXPECT_EQ(a.value(), b.value());
  a.add(std::numeric_limits<double>::quiet_NaN());
  b.add(-std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(a.value(), b.value());
  c.add(1.0);
  EXPECT_NE(a.value(), c.value());
}

TEST(Time, ConvertsSecondsAndClampsNonsense) {
  EXPECT_EQ(from_seconds(1.5).count(), 1'500'000'000);
  EXPECT_EQ(from_seconds(std::numeric_limits<double>::quiet_NaN()).count(), 0);
  EXPECT_EQ(from_seconds(std::numeric_limits<double>::infinity()).count(), 1'000'000'000'000'000'000);
  EXPECT_DOUBLE_EQ(seconds(Nanos{2'500'000}), 0.0025);
}

TEST(Result, HoldsAValueOrAReason) {
  const Result<int> good(3);
  const Result<int> bad(Status::kNoPath);
  EXPECT_TRUE(good.ok());
  EXPECT_EQ(good.value(), 3);
  EXPECT_FALSE(bad.ok());
  EXPECT_EQ(bad.status(), Status::kNoPath);
  EXPECT_STREQ(to_string(Status::kBudgetSpent), "budget spent");
}

TEST(NoAllocScope, SeesAnAllocation) {
  const test::NoAllocScope scope;
  const std::vector<int> heap(100);
  EXPECT_GE(scope.count(), 1U) << "a guard that sees nothing guards nothing";
  EXPECT_EQ(heap.size(), 100U);
}

}  // namespace
}  // namespace roborun::core
