#include <bit>

#include "stages/planning/way_memory.hpp"

namespace roborun::stages {
namespace {

/// Of a row of places those in known rooms that have one in an open or doubtful room beside them, and those in doubtful rooms
/// that have one in an open room beside them: the highest of each place's four bits, which says of a room whether it is known.
/// So a row is one operation.
std::uint64_t beside_other_kind(const WayRooms& rooms, std::int32_t y, std::int32_t z) noexcept {
  static_assert(kFirstOpenRoom == 8 && kFirstDoubtfulRoom == 13 && kRooms == 16);
  constexpr std::uint64_t kHigh = 0x8888'8888'8888'8888ULL;
  const auto row = [&rooms](std::int32_t at_y, std::int32_t at_z) {
    return ((at_y | at_z) & ~15) != 0
               ? 0
               : rooms.number[16 * static_cast<std::size_t>(at_z) + static_cast<std::size_t>(at_y)];
  };
  const auto doubtful = [](std::uint64_t n) { return n & n << 1U & (n << 2U | n << 3U) & kHigh; };
  const auto open = [&](std::uint64_t n) { return n & kHigh & ~doubtful(n); };
  const std::uint64_t n = row(y, z);
  const std::uint64_t known = (n << 1U | n << 2U | n << 3U) & ~n;
  const std::uint64_t any = n << 4U | n >> 4U | row(y - 1, z) | row(y + 1, z) | row(y, z - 1) | row(y, z + 1);
  const std::uint64_t beside_open = open(n) << 4U | open(n) >> 4U | open(row(y - 1, z)) |
                                    open(row(y + 1, z)) | open(row(y, z - 1)) | open(row(y, z + 1));
  return (known & any & kHigh) | (doubtful(n) & beside_open);
}

/// The rooms of the places at a face: of place u in row v, in bits 4 u and up.
using FaceRooms = std::array<std::uint64_t, kBlockCells>;
constexpr std::uint64_t kEach = 0x1111'1111'1111'1111ULL;

void face_of(const WayRooms& rooms, std::size_t face, FaceRooms& face_rooms) noexcept {
  const std::size_t side = face % 2 == 0 ? 15 : 0;
  for (std::size_t v = 0; v < face_rooms.size(); ++v) {
    if (face / 2 == 1) face_rooms[v] = rooms.number[16 * v + side];
    if (face / 2 == 2) face_rooms[v] = rooms.number[16 * side + v];
    if (face / 2 != 0) continue;
    std::uint64_t row = 0;
    for (std::size_t u = 0; u < face_rooms.size(); ++u)
      row |= (rooms.number[16 * v + u] >> (4 * side) & 15U) << (4 * u);
    face_rooms[v] = row;
  }
}

/// Those come last where there are more doors than fit.
bool is_doubtful_door(unsigned room, unsigned other) noexcept {
  return is_doubtful_room(room) || is_doubtful_room(other);
}

/// The places of two rooms that touch across a face.
struct FacePair {
  int count{}, u{}, v{};
  int away{1 << 30}, at_u{}, at_v{};  ///< Of the one that is nearest to their middle.
};

/// what(16 * room + other room, u, v) of all places that are not closed on either side, but row_of(rooms, v) of whole rows of
/// one such pair.
template <typename What, typename Row>
void for_each_place(const FaceRooms& mine, const FaceRooms& other, const What& what,
                    const Row& row_of) noexcept {
  const auto some = [](std::uint64_t row) { return (row | row >> 1U | row >> 2U | row >> 3U) & kEach; };
  for (int v = 0; v < kBlockCells; ++v) {
    const std::uint64_t a = mine[static_cast<std::size_t>(v)], b = other[static_cast<std::size_t>(v)];
    if (const std::uint64_t x = a & 15U, y = b & 15U; x != 0 && y != 0 && a == x * kEach && b == y * kEach) {
      row_of(static_cast<unsigned>(x << 4U | y), v);
      continue;
    }
    for (std::uint64_t bits = some(a) & some(b); bits != 0; bits &= bits - 1) {
      const int at = std::countr_zero(bits);
      what(static_cast<unsigned>((a >> at & 15U) << 4U | (b >> at & 15U)), at / 4, v);
    }
  }
}

}  // namespace

void WayMemory::find_doors(const Cell& block) noexcept {
  const std::int32_t kind = kind_at(position_of(block));
  if (kind >= 0) find_inner_doors(block_[static_cast<std::size_t>(kind)]);
  for (std::size_t face = 0; face < kFaces; ++face) {
    if (kind >= 0) find_face_doors(block_[static_cast<std::size_t>(kind)], block, face);
    const std::int32_t by = face % 2 == 0 ? 1 : -1;
    const Cell next{block.x + (face / 2 == 0 ? by : 0), block.y + (face / 2 == 1 ? by : 0),
                    block.z + (face / 2 == 2 ? by : 0)};
    const std::int32_t other = has(next) ? kind_at(position_of(next)) : kClosed;
    if (other >= 0 && !position_[position_of(next)].is_new)  // those have a turn of their own
      find_face_doors(block_[static_cast<std::size_t>(other)], next, face ^ 1U);
  }
}

void WayMemory::find_face_doors(Block& b, const Cell& block, std::size_t face) noexcept {
  b.doors[face] = 0;
  const std::int32_t by = face % 2 == 0 ? 1 : -1;
  const Cell next{block.x + (face / 2 == 0 ? by : 0), block.y + (face / 2 == 1 ? by : 0),
                  block.z + (face / 2 == 2 ? by : 0)};
  const std::int32_t kind = has(next) ? kind_at(position_of(next)) : kClosed;
  if (kind == kClosed) return;
  FaceRooms mine, other;
  face_of(b.rooms, face, mine);
  if (kind >= 0)
    face_of(block_[static_cast<std::size_t>(kind)].rooms, face ^ 1U, other);
  else
    other.fill(kEach * (kind == kKnown ? 1U : kFirstOpenRoom));
  std::array<FacePair, std::size_t{kRooms} * kRooms> pair;
  std::array<std::uint64_t, 4> met{};  // which of them there are
  const auto add = [&](unsigned rooms, int count, int u, int v) {
    FacePair& p = pair[rooms];
    const std::uint64_t bit = std::uint64_t{1} << (rooms % 64);
    if ((met[rooms / 64] & bit) == 0) p = {};
    met[rooms / 64] |= bit;
    p.count += count, p.u += u, p.v += v;
  };
  for_each_place(
      mine, other, [&](unsigned rooms, int u, int v) { add(rooms, 1, u, v); },
      [&](unsigned rooms, int v) { add(rooms, 16, 120, 16 * v); });
  const auto nearer = [&](unsigned rooms, int u, int v) {
    FacePair& p = pair[rooms];
    const int du = p.count * u - p.u, dv = p.count * v - p.v;
    if (du * du + dv * dv < p.away) p.away = du * du + dv * dv, p.at_u = u, p.at_v = v;
  };
  for_each_place(mine, other, nearer, [&](unsigned rooms, int v) {
    // Of a whole row the nearest one.
    const FacePair& p = pair[rooms];
    const int below = p.u / p.count;
    nearer(rooms, 2 * (p.u - below * p.count) > p.count ? below + 1 : below, v);
  });
  const int side = face % 2 == 0 ? 15 : 0;
  for (const bool doubtful : {false, true}) {
    for (unsigned i = 0; i < 4; ++i) {
      for (std::uint64_t bits = met[i]; bits != 0 && b.doors[face] < kDoorsPerFace; bits &= bits - 1) {
        const unsigned rooms = 64 * i + static_cast<unsigned>(std::countr_zero(bits));
        if (is_doubtful_door(rooms / kRooms, rooms % kRooms) != doubtful) continue;
        const FacePair& p = pair[rooms];
        const Cell c = face / 2 == 0   ? Cell{side, p.at_u, p.at_v}
                       : face / 2 == 1 ? Cell{p.at_u, side, p.at_v}
                                       : Cell{p.at_u, p.at_v, side};
        b.door[face][b.doors[face]++] = {
            static_cast<std::uint8_t>(rooms / kRooms), static_cast<std::uint8_t>(rooms % kRooms),
            static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y), static_cast<std::uint8_t>(c.z)};
      }
    }
  }
}

void WayMemory::find_inner_doors(Block& b) noexcept {
  b.doors[kInside] = 0;
  struct Pair {
    int count, x, y, z;
  };
  constexpr unsigned kOthers = kRooms - kFirstOpenRoom;
  std::array<Pair, std::size_t{kRooms} * kOthers> pair{};
  const auto for_each = [&b](const auto& what) {
    for (std::int32_t i = 0; i < 256; ++i) {
      const std::int32_t y = i % 16, z = i / 16;
      for (std::uint64_t bits = beside_other_kind(b.rooms, y, z); bits != 0; bits &= bits - 1) {
        const std::int32_t x = std::countr_zero(bits) / 4;
        const unsigned room = b.rooms.at(x, y, z);
        const auto beside = [&](std::int32_t nx, std::int32_t ny, std::int32_t nz) {
          if (((nx | ny | nz) & ~15) != 0) return;
          const unsigned other = b.rooms.at(nx, ny, nz);
          if (other >= kFirstOpenRoom && !(is_doubtful_room(room) && is_doubtful_room(other)))
            what(room * kOthers + other - kFirstOpenRoom, x, y, z);
        };
        beside(x + 1, y, z), beside(x - 1, y, z), beside(x, y + 1, z), beside(x, y - 1, z),
            beside(x, y, z + 1), beside(x, y, z - 1);
      }
    }
  };
  for_each([&pair](unsigned rooms, int x, int y, int z) {
    Pair& p = pair[rooms];
    ++p.count, p.x += x, p.y += y, p.z += z;
  });
  for (Pair& p : pair) {
    if (p.count > 0) p.x /= p.count, p.y /= p.count, p.z /= p.count;  // their middle from now on
  }
  std::array<int, pair.size()> best{};
  std::array<Door, pair.size()> door{};
  best.fill(1 << 30);
  for_each([&](unsigned rooms, int x, int y, int z) {
    const Pair& p = pair[rooms];
    const int dx = x - p.x, dy = y - p.y, dz = z - p.z;
    const int away = dx * dx + dy * dy + dz * dz;
    if (away >= best[rooms]) return;
    best[rooms] = away;
    door[rooms] = {static_cast<std::uint8_t>(rooms / kOthers),
                   static_cast<std::uint8_t>(rooms % kOthers + kFirstOpenRoom), static_cast<std::uint8_t>(x),
                   static_cast<std::uint8_t>(y), static_cast<std::uint8_t>(z)};
  });
  for (const bool doubtful : {false, true}) {
    for (std::size_t i = 0; i < pair.size() && b.doors[kInside] < kDoorsPerFace; ++i) {
      if (pair[i].count > 0 && is_doubtful_door(door[i].room, door[i].other) == doubtful)
        b.door[kInside][b.doors[kInside]++] = door[i];
    }
  }
}

}  // namespace roborun::stages
