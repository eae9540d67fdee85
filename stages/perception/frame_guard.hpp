/// Depth images that must not be believed. Source: failures of depth cameras seen in flight: black, white,
/// frozen with fresh stamps, half, of the wrong size or of the wrong time. A frame is used whole or not at
/// all.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "stages/perception/occupancy_map.hpp"

namespace roborun::stages {

/// Of the pixels that look at least kDownwards (sine) below the horizon, this part at least has information in a good frame: half
/// of stereo's may have none. Sky without values is ordinary, and so is a sensor of which no pixel looks down.
inline constexpr double kLeastInformedRatio = 0.25;
inline constexpr double kDownwards = 0.26;
/// Of the same pixels: with less the lens is covered.
inline constexpr double kCoveredRatio = 0.05;

/// kOk if a frame can be read: 8..1280 pixels a side, as many depths as pixels, range in (0, kMaxRange_m], least
/// range in [0, range), both tangents of the field of view in (0, kMaxTanHalfFov], finite pose. Otherwise kInvalidArgument. RT-safe: O(1).
[[nodiscard]] Status check_shape(const PosedDepthFrame& posed) noexcept;
/// kOk if a frame may be used at all: check_shape(), a pixel with information, and enough of those that look down (of a
/// cloud: none). Otherwise kInvalidArgument: black, NaN, the lower half missing, wrong size. RT-safe: O(pixels).
[[nodiscard]] Status check_frame(const PosedDepthFrame& posed) noexcept;

/// Why an image is not believed.
enum class FrameFault : std::uint8_t {
  kNone,
  kShape,    ///< check_shape().
  kStamp,    ///< Of another time than the others of its scan.
  kCovered,  ///< Hardly any information where ground or floor must be: a lens that is covered or blinded, darkness, nonsense.
  kFog,  ///< Too little of it (kLeastInformedRatio), but more than kCoveredRatio: fog, dust, a lens that is half covered.
  kFrozen,  ///< The same as before, with another stamp.
  kTurned,  ///< It disagrees with the map all over: not this guard's judgement, but that of who knows the map.
};
[[nodiscard]] constexpr const char* to_string(FrameFault fault) noexcept {
  constexpr std::array<const char*, 7> kName{"none", "shape", "stamp", "covered", "fog", "frozen", "turned"};
  return kName[static_cast<std::size_t>(fault)];
}

/// check_frame(), and what only the frames before can tell:
///  - stamps: a frame more than kStampSpread from the middle one of its scan, or a scan that much older than
///    the one before it, is refused. (Twice as old in a row is believed: the clock was set.)
///  - frozen: 64 pixels spread over the image, 8 of them or more showing a surface, that are bit-equal to
///    those of a remembered frame of another stamp. Noise makes that impossible; a camera without (DepthError), and an
///    image without surfaces, may repeat.
/// White, "nothing within the range" everywhere, is what an open sky looks like: BrickMap refuses it where it
/// knows of a surface.
class FrameGuard {
 public:
  static constexpr Nanos kStampSpread{250'000'000};

  /// To be called once a scan, before check(). RT-safe: O(frames).
  void begin(std::span<const PosedDepthFrame> scan) noexcept;
  /// What is wrong with it; check(): kOk if nothing is, or else kInvalidArgument. The same frame again is no frozen one, and an image of nothing but sky may be empty. RT-safe:
  /// O(1).
  [[nodiscard]] FrameFault judge(const PosedDepthFrame& posed) noexcept;
  [[nodiscard]] Status check(const PosedDepthFrame& posed) noexcept;
  /// The same for who knows that check_shape() is kOk.
  [[nodiscard]] Status check_content(const PosedDepthFrame& posed) noexcept;

 private:
  struct Print {
    std::uint64_t hash{};  ///< 0: none.
    MonotonicTime stamp{};
  };
  [[nodiscard]] FrameFault judge_content(const PosedDepthFrame& posed) noexcept;
  [[nodiscard]] bool frozen(const PosedDepthFrame& posed) noexcept;

  std::array<Print, 32> print_{};
  std::size_t next_{0};
  MonotonicTime scan_{};
  bool any_scan_{false};
  bool scan_too_old_{false};
};

}  // namespace roborun::stages
