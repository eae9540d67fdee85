#include "firmware_if/dronecan/bits.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "firmware_if/dronecan/crc.hpp"

namespace roborun::firmware_if::dronecan {
namespace {

TEST(Bits, PutTheLowByteFirstAndLeftAlignTheRest) {
  // 6557 = 0x199d in 14 bits: 9d, then 011001 and two bits of padding.
  std::array<std::uint8_t, 2> bytes{};
  BitWriter sut(bytes);
  sut.put<14>(6557);
  sut.finish();
  EXPECT_TRUE(sut.ok());
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 2>{0x9d, 0x64}));
}

TEST(Bits, ComeBackAsTheyWentForEveryWidthAndOffset) {
  std::uint64_t seed = 1;
  int checked = 0;
  const auto next = [&seed] { return seed = seed * 6364136223846793005ULL + 1442695040888963407ULL; };
  const auto round_trip = [&]<unsigned kBits>(std::integral_constant<unsigned, kBits>) {
    for (int i = 0; i < 100; ++i) {
      std::array<std::uint8_t, 24> bytes{};
      const std::uint64_t before = next() & 0x1f;
      const std::uint64_t value = next() & detail::kMask<kBits>;
      BitWriter writer(bytes);
      writer.put<5>(before);
      writer.put<kBits>(value);
      writer.put<3>(5);
      writer.finish();
      BitReader reader(std::span<const std::uint8_t>{bytes}.first(writer.size_bytes()));
      EXPECT_EQ(reader.get<5>(), before);
      EXPECT_EQ(reader.get<kBits>(), value);
      EXPECT_EQ(reader.get<3>(), 5U);
      EXPECT_TRUE(reader.ok() && writer.ok());
      ++checked;
    }
  };
  [&]<unsigned... kIndex>(std::integer_sequence<unsigned, kIndex...>) {
    (round_trip(std::integral_constant<unsigned, kIndex + 1>{}), ...);
  }
  (std::make_integer_sequence<unsigned, 56>{});
  EXPECT_EQ(checked, 5600);
}

TEST(Bits, BeyondTheEndAreRefused) {
  std::array<std::uint8_t, 1> bytes{};
  BitWriter writer(bytes);
  writer.put<9>(1);
  writer.finish();
  EXPECT_FALSE(writer.ok());
  BitReader reader(bytes);
  EXPECT_EQ(reader.get<9>(), 0U);
  EXPECT_FALSE(reader.ok());
}

TEST(HalfPrecision, RoundsTripsEveryNumber) {
  int checked = 0;
  for (unsigned half = 0; half <= 0xffff; ++half) {
    const float value = from_half(static_cast<std::uint16_t>(half));
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(from_half(to_half(value))));
      continue;
    }
    EXPECT_EQ(to_half(value), half);
    ++checked;
  }
  EXPECT_EQ(checked, 65536 - 2 * 1023);
}

TEST(HalfPrecision, IsTheNearestWithTiesToEven) {
  // Around every midpoint of two neighbours: the midpoint goes to the even one, its neighbours to theirs.
  int checked = 0;
  for (unsigned half = 0; half < 0x7bff; ++half) {
    const float low = from_half(static_cast<std::uint16_t>(half));
    const float high = from_half(static_cast<std::uint16_t>(half + 1));
    const float middle = 0.5F * (low + high);
    EXPECT_EQ(to_half(middle), half % 2 == 0 ? half : half + 1);
    EXPECT_EQ(to_half(std::nextafter(middle, 0.0F)), half);
    EXPECT_EQ(to_half(std::nextafter(middle, 1e9F)), half + 1);
    EXPECT_EQ(to_half(-middle), (half % 2 == 0 ? half : half + 1) | 0x8000U);
    ++checked;
  }
  EXPECT_EQ(checked, 0x7bff);
}

TEST(HalfPrecision, ClampsWhatIsTooBig) {
  EXPECT_EQ(to_half(65520.0F), 0x7bff);
  EXPECT_EQ(to_half(-1e30F), 0xfbff);
  EXPECT_EQ(to_half(std::numeric_limits<float>::infinity()), 0x7c00);
}

TEST(Crc16, GivesThePublishedCheckValue) {
  constexpr std::array<std::uint8_t, 9> kDigits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc16(kDigits), 0x29b1);
}

TEST(Crc64, GivesThePublishedCheckValue) {
  Crc64 sut;
  for (const char c : {'1', '2', '3', '4', '5', '6', '7', '8', '9'}) sut.add(static_cast<std::uint8_t>(c));
  EXPECT_EQ(sut.value(), 0x62ec59e3f1a4f00aULL);
}

}  // namespace
}  // namespace roborun::firmware_if::dronecan
