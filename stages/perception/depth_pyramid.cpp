#include "stages/perception/depth_pyramid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace roborun::stages {

namespace {

using Entry = DepthPyramid::Entry;

Entry entry_of(float visible_m, float range_m, float steps_per_m) noexcept {
  // The whole range is its own step: what is empty up to the range satisfies every need within it.
  const std::int32_t least =
      visible_m < range_m ? static_cast<std::int32_t>(visible_m * steps_per_m) : DepthPyramid::kMaxSteps;
  const std::int32_t most = visible_m < range_m ? least + 1 : DepthPyramid::kMaxSteps;
  return {static_cast<std::int16_t>(least), static_cast<std::int16_t>(DepthPyramid::kMaxSteps - most)};
}

std::int16_t min16(std::int16_t a, std::int16_t b) noexcept { return a < b ? a : b; }

Entry min_of(Entry a, Entry b) noexcept {
  return {min16(a.least_steps, b.least_steps), min16(a.not_most_steps, b.not_most_steps)};
}

/// See the class comment: the nearest neighbour of a pixel without information, or 0 if most have none either.
float bridged_m(const firmware_if::DepthFrame& frame, std::size_t u, std::size_t v) noexcept {
  float nearest_m = frame.range_m;
  int neighbours = 0, known = 0;
  for (std::size_t y = v > 0 ? v - 1 : 0; y < std::min<std::size_t>(v + 2, frame.height); ++y) {
    for (std::size_t x = u > 0 ? u - 1 : 0; x < std::min<std::size_t>(u + 2, frame.width); ++x) {
      ++neighbours;  // itself among them
      const float depth_m = frame.depth_m[y * frame.width + x];
      if (!(depth_m > frame.range_min_m)) continue;
      ++known;
      nearest_m = std::min(nearest_m, depth_m);
    }
  }
  return 2 * known > neighbours ? nearest_m : 0.0F;
}

std::size_t entry_count(std::size_t width, std::size_t height) noexcept {
  constexpr std::size_t kPad = 3;  // entries are read four at a time
  std::size_t total = 2 * width * height + DepthPyramid::kMaxLevels + kPad;
  while (width > 1 || height > 1) {
    width = (width + 1) / 2;
    height = (height + 1) / 2;
    total += width * height;
  }
  return total;
}

}  // namespace

std::size_t DepthPyramid::arena_bytes(std::size_t max_width, std::size_t max_height) noexcept {
  return entry_count(max_width, max_height) * sizeof(Entry) +
         (max_width + 1) * (max_height + 1) * sizeof(std::uint32_t) + 2 * alignof(std::max_align_t);
}

DepthPyramid::DepthPyramid(core::Arena& arena, std::size_t max_width, std::size_t max_height,
                           const char* name) noexcept
    : max_width_(max_width), max_height_(max_height) {
  memory_ = arena.take<Entry>(entry_count(max_width, max_height), name);
  pool_ = &arena.last_pool();
  seen_ = arena.take<std::uint32_t>((max_width + 1) * (max_height + 1), "map seen pixels");
  arena.last_pool().use(seen_.size());
}

bool DepthPyramid::bridge_strip(const firmware_if::DepthFrame& frame, std::size_t y, unsigned shift,
                                const StripSeen& strip, Entry* tile) noexcept {
  const std::size_t columns = (frame.width + (std::size_t{1} << shift) - 1) >> shift;
  const std::size_t bottom = std::min<std::size_t>(y + (std::size_t{1} << shift), frame.height);
  bool any_lost = false;
  const auto look_at = [&](std::size_t u, std::size_t v) {
    if (frame.depth_m[v * frame.width + u] > frame.range_min_m) return;
    const float nearest_m = bridged_m(frame, u, v);
    if (nearest_m > 0.0F) {
      Entry& entry = tile[u >> shift];
      entry = min_of(entry, entry_of(nearest_m, frame.range_m, steps_per_m_));
      return;
    }
    if (!any_lost) std::fill_n(lost_.begin(), columns, std::uint8_t{0});
    any_lost = true;
    ++lost_[u >> shift];
  };
  for (std::size_t word = 0; word < StripSeen::kWords; ++word) {
    for (std::uint64_t bits = strip.incomplete[word]; bits != 0; bits &= bits - 1) {
      const std::size_t first = 512 * word + 8 * static_cast<std::size_t>(std::countr_zero(bits));
      for (std::size_t v = y; v < bottom; ++v)
        for (std::size_t u = first; u < std::min<std::size_t>(first + 8, frame.width); ++u) look_at(u, v);
    }
  }
  return any_lost;
}

void DepthPyramid::count_strip(const firmware_if::DepthFrame& frame, std::size_t y, unsigned shift,
                               bool any_lost) noexcept {
  const std::size_t columns = (frame.width + (std::size_t{1} << shift) - 1) >> shift, row = columns + 1;
  std::uint32_t* const above = seen_.data() + (y >> shift) * row;
  std::uint32_t* const below = above + row;
  const std::size_t rows = std::min<std::size_t>(std::size_t{1} << shift, frame.height - y);
  const auto before = [&](std::size_t x) { return std::min<std::size_t>(x << shift, frame.width); };
  if (!has_holes_) {
    // All rows above were whole.
    for (std::size_t v = 0; v <= y >> shift; ++v)
      for (std::size_t x = 0; x <= columns; ++x)
        seen_[v * row + x] = static_cast<std::uint32_t>((v << shift) * before(x));
    has_holes_ = true;
  }
  std::uint32_t lost = 0;
  below[0] = 0;
  for (std::size_t x = 1; x <= columns; ++x) {
    if (any_lost) lost += lost_[x - 1];
    below[x] = above[x] + static_cast<std::uint32_t>(before(x) * rows) - lost;
  }
}

void DepthPyramid::fill_tiles(const firmware_if::DepthFrame& frame, unsigned shift, Entry* tile) noexcept {
  const std::size_t side = std::size_t{1} << shift;
  const std::size_t columns = (frame.width + side - 1) >> shift;
  shows_surface_ = has_holes_ = false;
  for (std::size_t y = 0; y < frame.height; y += side, tile += columns) {
    const DepthStrip strip{frame.depth_m.data() + y * frame.width,
                           frame.width,
                           std::min(side, frame.height - y),
                           frame.range_m,
                           frame.range_min_m,
                           steps_per_m_};
    const StripSeen seen = tile_steps(strip, static_cast<int>(shift), tile);
    shows_surface_ = shows_surface_ || seen.surface;
    const bool lost = bridge_strip(frame, y, shift, seen, tile);
    if (lost || has_holes_) count_strip(frame, y, shift, lost);
  }
  shows_anything_ = !has_holes_ || seen_[((frame.height + side - 1) >> shift) * (columns + 1) + columns] > 0;
}

Status DepthPyramid::build(const firmware_if::DepthFrame& frame, int tile_shift) noexcept {
  const auto tiles = [tile_shift](std::size_t pixels) {
    return (pixels + (std::size_t{1} << static_cast<unsigned>(tile_shift)) - 1) >>
           static_cast<unsigned>(tile_shift);
  };
  const std::size_t side = std::max(frame.width, frame.height);
  if (side > kMaxImageSide || tiles(frame.width) > max_width_ || tiles(frame.height) > max_height_ ||
      memory_.empty())
    return Status::kCapacity;
  steps_per_m_ = static_cast<float>(kMaxSteps - 1) / frame.range_m;
  width_ = frame.width;
  height_ = frame.height;
  const auto shift = static_cast<unsigned>(std::clamp(tile_shift, 0, 3));
  std::size_t width = (frame.width + (std::size_t{1} << shift) - 1) >> shift;
  std::size_t height = (frame.height + (std::size_t{1} << shift) - 1) >> shift;
  Entry* fine = memory_.data();
  fill_tiles(frame, shift, fine);
  level_[0] = {fine, static_cast<std::int32_t>(width), static_cast<int>(shift), 1};
  const int first = static_cast<int>(shift) + 1;
  for (int k = first; k < kMaxLevels; ++k) {
    // From windows of half the side: this one and the one after it, in both directions.
    const std::size_t stride = k == first ? 1 : 2;
    const std::size_t to_width = (width + stride - 1) / stride;
    const std::size_t to_height = (height + stride - 1) / stride;
    Entry* coarse = fine + width * height;
    for (std::size_t y = 0; y < to_height; ++y) {
      const Entry* above = fine + stride * y * width;
      const Entry* below = fine + std::min(stride * y + stride, height - 1) * width;
      Entry* to = coarse + y * to_width;
      const std::size_t inner = width > stride ? (width - 1) / stride : 0;
      least_of_four(above, below, stride, inner, to);
      for (std::size_t x = inner; x < to_width; ++x) {
        const std::size_t last = width - 1;
        to[x] = min_of(min_of(above[stride * x], above[last]), min_of(below[stride * x], below[last]));
      }
    }
    level_[static_cast<std::size_t>(k)] = {coarse, static_cast<std::int32_t>(to_width), k - 1, 2};
    fine = coarse;
    width = to_width;
    height = to_height;
  }
  pool_->use(static_cast<std::size_t>(fine - memory_.data()) + width * height);
  return Status::kOk;
}

DepthPyramid::Bound DepthPyramid::bound(int u0, int v0, int u1, int v1) const noexcept {
  const Level& l = level(std::max(level_for(std::max(u1 - u0, v1 - v0) + 1), first_level()));
  const auto first = [&l](int from) { return from >> l.shift; };
  const auto last = [&l, first](int from, int to) {
    return std::max(((to + (1 << l.shift)) >> l.shift) - l.back, first(from));
  };
  const auto at = [&l](int x, int y) { return l.entry[y * l.width + x]; };
  const int x0 = first(u0), x1 = last(u0, u1), y0 = first(v0), y1 = last(v0, v1);
  const Entry e = min_of(min_of(at(x0, y0), at(x1, y0)), min_of(at(x0, y1), at(x1, y1)));
  return {static_cast<float>(std::min<std::int32_t>(e.least_steps, kMaxSteps - 1)) / steps_per_m_,
          static_cast<float>(kMaxSteps - e.not_most_steps) / steps_per_m_};
}

}  // namespace roborun::stages
