#include "stages/planning/way_memory.hpp"

#include <algorithm>
#include <cmath>

#include "core/random/counter_rng.hpp"
#include "firmware_if/assert.hpp"

namespace roborun::stages {
namespace {

constexpr std::size_t kMaxPositions = 1U << 18U;
constexpr std::size_t kHeap = 1U << 17U;
constexpr std::int32_t kWindow = 13, kWindowHeight = 9;  // blocks of one look, and one more for the widths
constexpr std::size_t kWindowBlocks =
    static_cast<std::size_t>(kWindow + 1) * (kWindow + 1) * (kWindowHeight + 1);
constexpr double kStands_m = 0.3;  // from one look to the next
constexpr Nanos kMostWaited{60'000'000'000};
constexpr std::uint64_t kWorkOfABlock = 64;  // lookups that a block that changed counts as

std::int32_t whole(double x) noexcept { return static_cast<std::int32_t>(std::floor(x)); }

/// Whether some of the cells may be occupied, but not surely.
bool is_doubtful(const CellBlock& cells) noexcept {
  unsigned doubtful = 0;
  for (std::size_t i = 0; i < cells.sure.size(); ++i)
    doubtful |= (unsigned{cells.occupied[i]} ^ cells.sure[i]) | cells.vague[i];
  return doubtful != 0;
}

std::uint64_t digest_of(const CellBlock& cells) noexcept {
  std::uint64_t digest = 1;
  for (std::size_t i = 0; i < cells.free.size(); i += 2) {
    const std::uint64_t four = (std::uint64_t{cells.free[i]} << 48U) |
                               (std::uint64_t{cells.free[i + 1]} << 32U) |
                               (std::uint64_t{cells.occupied[i]} << 16U) | cells.occupied[i + 1];
    digest = (digest ^ four) * 0x9E3779B97F4A7C15ULL;
    digest ^= digest >> 29U;
  }
  if (!is_doubtful(cells)) return digest;
  for (std::size_t i = 0; i < cells.sure.size(); ++i)
    digest = core::mix64(digest + (std::uint64_t{cells.vague[i]} << 16U | cells.sure[i]));
  return digest;
}

/// The same of all of them.
bool has_doubts(const WayCells& cells) noexcept {
  for (std::size_t i = 0; i < cells.block.size(); ++i)
    if (cells.content[i] == BlockContent::kMixed && is_doubtful(*cells.block[i])) return true;
  return false;
}

/// The first block, in cells from the world's origin, and the number of blocks.
struct Extent {
  std::array<std::int32_t, 3> corner{}, size{};
  double blocks{1.0};
};

Extent extent_of(const WayMemory::Config& config) noexcept {
  Extent e;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<int>(i);
    const double low = std::floor((config.bounds_W.min_W[axis] - config.radius_m) / block_m(config.finest_m));
    const double high = std::floor(config.bounds_W.max_W[axis] / block_m(config.finest_m)) + 1.0;
    e.blocks *= std::fmax(high - low, 1.0);
    e.corner[i] = static_cast<std::int32_t>(std::fmax(low, -1e6)) * kBlockCells;
    e.size[i] = static_cast<std::int32_t>(std::fmin(high - low, 1e6));
  }
  return e;
}

/// One cell less on either side than plans take, for that much surfaces are off, and no less than the vehicle.
int narrow_width(const WayMemory::Config& config) noexcept {
  const int body = static_cast<int>(std::ceil(2.0 * config.body_m / config.finest_m - 1e-6));
  const int across = WayMemory::cells_across(config);
  return std::clamp(body, std::max(across - 2, 1), across);
}

/// Of the square inside the vehicle's circle, seen from above, so many cells as surely fit into it: however a gap lies.
int core_width(const WayMemory::Config& config) noexcept {
  constexpr double kInscribed = 0.7071;
  return std::max(static_cast<int>(std::floor(2.0 * kInscribed * config.body_m / config.finest_m)), 1);
}

}  // namespace

double WayMemory::positions(const Config& config) noexcept { return extent_of(config).blocks; }

int WayMemory::cells_across(const Config& config) noexcept {
  return ball_shape(config.radius_m / config.finest_m).width;
}

bool WayMemory::fits(const Config& config) noexcept {
  return positions(config) <= static_cast<double>(kMaxPositions) && cells_across(config) <= kMostAcross &&
         config.body_m <= config.radius_m;
}

std::size_t WayMemory::arena_bytes(const Config& config) noexcept {
  const auto count = static_cast<std::size_t>(extent_of(config).blocks);
  return count * (sizeof(Position) + sizeof(Node)) +
         config.max_blocks * (sizeof(Block) + kRooms * sizeof(Node)) + kWindowBlocks * sizeof(Seen) +
         kHeap * sizeof(std::uint64_t) + 1024;
}

WayMemory::WayMemory(const Config& config, core::Arena& arena) noexcept
    : config_((ROBORUN_ASSERT(fits(config)), config)),
      width_(cells_across(config)),
      narrow_width_(narrow_width(config)),
      core_width_(core_width(config)),
      position_(arena.take<Position>(static_cast<std::size_t>(extent_of(config).blocks), "way positions")),
      position_pool_(arena.last_pool()),
      block_(arena.take<Block>(config.max_blocks, "way blocks")),
      block_pool_(arena.last_pool()),
      window_(arena.take<Seen>(kWindowBlocks, "way window")),
      window_pool_(arena.last_pool()),
      node_(arena.take<Node>(position_.size() + kRooms * config.max_blocks, "way nodes")),
      node_pool_(arena.last_pool()),
      reached_(kHeap, "way heap", arena) {
  const Extent e = extent_of(config);
  corner_ = {e.corner[0], e.corner[1], e.corner[2]};
  size_ = {e.size[0], e.size[1], e.size[2]};
  forget();
}

void WayMemory::forget() noexcept {
  std::fill(position_.begin(), position_.end(), Position{});
  for (std::size_t i = 0; i < block_.size(); ++i) block_[i].position = static_cast<std::uint32_t>(i + 1);
  free_ = 0;
  block_count_ = 0;
  seen_count_ = 0;
  ++search_;  // what was found by the last one is not there any more
  doubts_ = false;
  turn_ = 0;
  last_look_ = kNoLook;
  seen_low_ = {0, 0, 0};
  seen_high_ = {-1, -1, -1};
}

WayMemory::Cell WayMemory::place_of(const Vector3& p_W) const noexcept {
  const auto axis = [&](double p, std::int32_t corner) {
    return whole(p / config_.finest_m - 0.5 * width_ + 0.5) - corner;
  };
  return {axis(p_W.x(), corner_.x), axis(p_W.y(), corner_.y), axis(p_W.z(), corner_.z)};
}

Vector3 WayMemory::at_W(const Cell& place) const noexcept {
  return config_.finest_m * Vector3(place.x + corner_.x + 0.5 * width_, place.y + corner_.y + 0.5 * width_,
                                    place.z + corner_.z + 0.5 * width_);
}

unsigned WayMemory::room_at(const Cell& place) const noexcept {
  const Cell block{place.x >> 4, place.y >> 4, place.z >> 4};
  return has(block) ? room_at(kind_at(position_of(block)), {place.x & 15, place.y & 15, place.z & 15}) : 0;
}

unsigned WayMemory::room_at(std::int32_t kind, const Cell& inside) const noexcept {
  if (kind == kOpen) return kFirstOpenRoom;
  if (kind == kKnown) return 1;
  if (kind == kClosed) return 0;
  return block_[static_cast<std::size_t>(kind)].rooms.at(inside.x, inside.y, inside.z);
}

bool WayMemory::nearest_room(const Vector3& p_W, Cell& place) const noexcept {
  if (!is_finite(p_W) || !(p_W.cwiseAbs().maxCoeff() < kMost_m)) return false;
  const Cell at = place_of(p_W);
  place = at;
  if (is_known_room(room_at(at))) return true;
  int best = 1000;
  for (std::int32_t dz = -2; dz <= 2; ++dz) {
    for (std::int32_t dy = -2; dy <= 2; ++dy) {
      for (std::int32_t dx = -2; dx <= 2; ++dx) {
        const Cell c{at.x + dx, at.y + dy, at.z + dz};
        const unsigned room = room_at(c);
        if (room == 0 || is_doubtful_room(room)) continue;
        const int cost = dx * dx + dy * dy + dz * dz + (is_known_room(room) ? 0 : 100);
        if (cost >= best) continue;
        best = cost;
        place = c;
      }
    }
  }
  return best < 1000;
}

std::uint32_t WayMemory::node_of(std::uint32_t position, unsigned room) const noexcept {
  const std::int32_t kind = kind_at(position);
  if (kind < 0) return position;
  return static_cast<std::uint32_t>(position_.size() + kRooms * static_cast<std::size_t>(kind) + room);
}

WayMemory::Block* WayMemory::take(std::uint32_t position) noexcept {
  std::int32_t& kind = position_[position].kind;
  if (kind >= 0) return &block_[static_cast<std::size_t>(kind)];
  if (free_ >= block_.size()) return nullptr;
  kind = static_cast<std::int32_t>(free_);
  Block& block = block_[free_];
  free_ = block.position;
  block.position = position;
  block_pool_.use(++block_count_);
  return &block;
}

void WayMemory::give_back(std::int32_t block) noexcept {
  if (block < 0) return;
  block_[static_cast<std::size_t>(block)].position = free_;
  free_ = static_cast<std::uint32_t>(block);
  --block_count_;
}

bool WayMemory::read_window(const MapView& map, const Cell& low, const Cell& high, core::StageBudget& budget,
                            core::Work& work) noexcept {
  std::size_t count = 0;
  for (std::int32_t z = low.z; z <= high.z + 1; ++z) {
    for (std::int32_t y = low.y; y <= high.y + 1; ++y) {
      if (budget.spent(work)) return false;
      for (std::int32_t x = low.x; x <= high.x + 1; ++x, ++count) {
        const Vector3 corner_W =
            config_.finest_m *
            Vector3(corner_.x + kBlockCells * x, corner_.y + kBlockCells * y, corner_.z + kBlockCells * z);
        Seen& seen = window_[place_in_window({x, y, z})];
        const std::uint64_t revision = blocks_revision(map, corner_W, config_.finest_m, work.units);
        if (revision != 0 && seen.block == Cell{x, y, z} && seen.revision == revision) continue;
        seen.block = {x, y, z};
        seen.revision = revision;
        seen.content = read_blocks(map, corner_W, config_.finest_m, seen.cells, work.units);
        seen.digest = seen.content == BlockContent::kMixed ? digest_of(seen.cells)
                                                           : static_cast<std::uint64_t>(seen.content);
      }
    }
  }
  window_pool_.use(count);
  return true;
}

std::size_t WayMemory::place_in_window(const Cell& block) noexcept {
  const auto within = [](std::int32_t at, std::int32_t size) { return static_cast<std::size_t>(at % size); };
  return (within(block.z, kWindowHeight + 1) * (kWindow + 1) + within(block.y, kWindow + 1)) * (kWindow + 1) +
         within(block.x, kWindow + 1);
}

std::uint64_t WayMemory::cells_at(const Cell& block, WayCells& cells) const noexcept {
  std::uint64_t digest = 0;
  for (std::int32_t i = 0; i < 8; ++i) {
    const Seen& seen =
        window_[place_in_window({block.x + (i & 1), block.y + ((i >> 1) & 1), block.z + (i >> 2)})];
    cells.block[static_cast<std::size_t>(i)] = &seen.cells;
    cells.content[static_cast<std::size_t>(i)] = seen.content;
    digest = core::mix64(digest + seen.digest + 1);
  }
  return digest | 1U;
}

Status WayMemory::look(const MapView& map, const WayLook& look, core::StageBudget& budget,
                       core::Work& work) noexcept {
  if (!is_finite(look.from_W) || !(look.from_W.cwiseAbs().maxCoeff() < kMost_m))
    return Status::kInvalidArgument;
  const Cell at = place_of(look.from_W);
  const auto blocks =
      static_cast<std::int32_t>(std::ceil(std::fmin(look.reach_m, kMost_m) / block_m(config_.finest_m)));
  const std::int32_t side = std::min(blocks, (kWindow - 1) / 2),
                     up = std::min(blocks, (kWindowHeight - 1) / 2);
  const Cell low{std::max((at.x >> 4) - side, 0), std::max((at.y >> 4) - side, 0),
                 std::max((at.z >> 4) - up, 0)};
  const Cell high{std::min((at.x >> 4) + side, size_.x - 1), std::min((at.y >> 4) + side, size_.y - 1),
                  std::min((at.z >> 4) + up, size_.z - 1)};
  if (low.x > high.x || low.y > high.y || low.z > high.z) return Status::kInvalidArgument;
  if (!read_window(map, low, high, budget, work)) return Status::kBudgetSpent;
  if (seen_low_.x > seen_high_.x) seen_low_ = low, seen_high_ = high;
  seen_low_ = {std::min(seen_low_.x, low.x), std::min(seen_low_.y, low.y), std::min(seen_low_.z, low.z)};
  seen_high_ = {std::max(seen_high_.x, high.x), std::max(seen_high_.y, high.y),
                std::max(seen_high_.z, high.z)};
  wait_at(look);
  const bool is_whole = renew_changed(low, high, budget, work);
  return is_whole ? Status::kOk : Status::kBudgetSpent;
}

bool WayMemory::renew_changed(const Cell& low, const Cell& high, core::StageBudget& budget,
                              core::Work& work) noexcept {
  const Cell size{high.x - low.x + 1, high.y - low.y + 1, high.z - low.z + 1};
  const auto count =
      static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) * static_cast<std::size_t>(size.z);
  std::size_t changed = 0;
  bool is_whole = true;
  // In turns: where noise changes more blocks than fit in a look, all of them get into one.
  std::size_t done = 0;
  for (; done < count && changed < changed_.size() && is_whole; ++done) {
    const auto at = static_cast<std::int32_t>((turn_ + done) % count);
    const Cell block{low.x + at % size.x, low.y + at / size.x % size.y, low.z + at / (size.x * size.y)};
    WayCells cells;
    const std::uint64_t digest = cells_at(block, cells);
    Position& position = position_[position_of(block)];
    if (position.digest == digest) continue;
    work.units += kWorkOfABlock;
    is_whole = !budget.spent(work);
    if (!is_whole) break;
    if (position.digest == 0) position_pool_.use(++seen_count_);
    position.digest = digest;
    renew(block, cells);
    position.is_new = true;
    changed_[changed++] = block;
  }
  is_behind_ = done < count;
  turn_ = (turn_ + done) % count;
  for (std::size_t i = 0; i < changed; ++i) find_doors(changed_[i]);
  for (std::size_t i = 0; i < changed; ++i) position_[position_of(changed_[i])].is_new = false;
  return is_whole;
}

void WayMemory::wait_at(const WayLook& look) noexcept {
  const bool stands = (look.from_W - last_look_.from_W).norm() < kStands_m;
  const auto units = std::clamp(look.now - last_look_.now, Nanos{0}, kMostWaited) / kWaitUnit;
  last_look_ = look;
  if (!stands) return;
  const Cell at = place_of(look.from_W);
  for (std::int32_t i = 0; i < 27; ++i) {
    const Cell block{(at.x >> 4) + i % 3 - 1, (at.y >> 4) + i / 3 % 3 - 1, (at.z >> 4) + i / 9 - 1};
    if (!has(block)) continue;
    std::uint16_t& waited = position_[position_of(block)].waited;
    waited = static_cast<std::uint16_t>(std::min<Nanos::rep>(waited + units, kMostWaited / kWaitUnit));
  }
}

void WayMemory::forbid(const Cell& block, WayPlaces& places) const noexcept {
  const Cell first{kBlockCells * block.x, kBlockCells * block.y, kBlockCells * block.z};
  const Vector3 r = Vector3::Constant(config_.radius_m);
  const Vector3 low_W = at_W(first), high_W = at_W({first.x + 15, first.y + 15, first.z + 15});
  const Aabb& bounds_W = config_.bounds_W;
  if (bounds_W.contains(low_W) && bounds_W.contains(high_W) &&
      (config_.fence.empty() || config_.fence.allows(Aabb{low_W - r, high_W + r})))
    return;
  // Per axis the places inside the bounds.
  std::array<unsigned, 3> inside{};
  for (std::int32_t i = 0; i < kBlockCells; ++i) {
    const Vector3 p_W = at_W({first.x + i, first.y + i, first.z + i});
    for (int axis = 0; axis < 3; ++axis)
      if (p_W[axis] >= bounds_W.min_W[axis] && p_W[axis] <= bounds_W.max_W[axis])
        inside[static_cast<std::size_t>(axis)] |= 1U << static_cast<unsigned>(i);
  }
  for (std::int32_t i = 0; i < 256; ++i) {
    const Cell row{first.x, first.y + i % kBlockCells, first.z + i / kBlockCells};
    std::uint16_t &known = places.known[static_cast<std::size_t>(i)],
                  &open = places.open[static_cast<std::size_t>(i)];
    const bool is_inside = ((inside[1] >> (i % kBlockCells)) & (inside[2] >> (i / kBlockCells)) & 1U) != 0;
    unsigned keep = is_inside ? inside[0] & static_cast<unsigned>(known | open) : 0U;
    for (unsigned bits = config_.fence.empty() ? 0U : keep; bits != 0; bits &= bits - 1) {
      const std::int32_t x = __builtin_ctz(bits);
      const Vector3 p_W = at_W({row.x + x, row.y, row.z});
      if (!config_.fence.allows(Aabb{p_W - r, p_W + r})) keep &= ~(1U << static_cast<unsigned>(x));
    }
    known = static_cast<std::uint16_t>(known & keep);
    open = static_cast<std::uint16_t>(open & keep);
  }
}

void WayMemory::renew(const Cell& block, const WayCells& cells) noexcept {
  WayPlaces places;
  find_places(cells, ball_shape(config_.radius_m / config_.finest_m), 0, places);
  forbid(block, places);
  WayCells sure = cells;
  sure.only_sure = has_doubts(cells);
  const auto all = [](const CellRows& rows, std::uint16_t value) {
    return std::all_of(rows.begin(), rows.end(), [value](std::uint16_t row) { return row == value; });
  };
  const std::uint32_t position = position_of(block);
  std::int32_t& kind = position_[position].kind;
  std::int32_t uniform = all(places.known, 0xFFFF) ? kKnown : all(places.open, 0xFFFF) ? kOpen : 0;
  CellRows passable{};
  if (uniform == 0) {
    passable = find_passable(block, cells, sure, places);
    if (all(places.known, 0) && all(places.open, 0) && all(passable, 0)) uniform = kClosed;
  }
  if (uniform < 0) {
    give_back(kind);
    kind = uniform;
    return;
  }
  Block* b = take(position);
  if (b == nullptr) return;
  WayPlaces narrow;
  if (narrow_width_ < width_ || sure.only_sure) find_places(sure, cube_shape(narrow_width_), 0, narrow);
  forbid(block, narrow);
  for (std::size_t i = 0; i < narrow.known.size(); ++i)
    places.doubtful[i] = static_cast<std::uint16_t>((places.doubtful[i] | narrow.known[i] | narrow.open[i]) &
                                                    ~places.known[i] & ~places.open[i]);
  number_rooms(places, b->rooms);
  b->passable = passable;
}

}  // namespace roborun::stages
