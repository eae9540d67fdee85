#include "platform/flight/trail.hpp"

#include <gtest/gtest.h>

namespace roborun::flight {
namespace {

TEST(Trail, HoldsTheLastPlacesTheNewestFirst) {
  Trail sut;
  EXPECT_EQ(sut.size(), 0U);
  for (int i = 0; i < 100; ++i) {
    sut.note(Vector3(i, 0, 0));
    sut.note(Vector3(i + 0.9 * Trail::kStep_m, 0, 0));  // too near
    ASSERT_EQ(sut.back(0), Vector3(i, 0, 0));
  }
  ASSERT_EQ(sut.size(), Trail::kPlaces);
  for (std::size_t i = 0; i < sut.size(); ++i) EXPECT_EQ(sut.back(i).x(), 99.0 - static_cast<double>(i));
}

}  // namespace
}  // namespace roborun::flight
