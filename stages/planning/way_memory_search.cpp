#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/planning/planner.hpp"
#include "stages/planning/way_memory.hpp"

namespace roborun::stages {
namespace {

constexpr double kCost_m = 0.01;  // of costs
constexpr std::uint32_t kNodesPerPoll = 256;
constexpr double kDoubtful = 4.0;  // times as dear as what is unknown
// Where the vehicle stood so long, what is unknown costs twice as much, after twice as long five times.
constexpr Nanos kWaits{1'600'000'000};
constexpr std::uint32_t kBeyond = 3000;  // units of cost that the search runs on beyond the vehicle

}  // namespace

double WayMemory::price(std::uint32_t position, unsigned room) const noexcept {
  if (is_known_room(room)) return 1.0;
  const double waits = static_cast<double>(position_[position].waited) / (kWaits / kWaitUnit);
  const double unknown = kUnknownWeight * (1.0 + waits * waits);
  return is_doubtful_room(room) ? kDoubtful * unknown : unknown;
}

std::uint32_t WayMemory::step_cost(const Cell& from, const Cell& to, double price) const noexcept {
  const double length_m = config_.finest_m * Vector3(from.x - to.x, from.y - to.y, from.z - to.z).norm();
  return static_cast<std::uint32_t>(std::lround(length_m / kCost_m * price));
}

void WayMemory::reach(std::uint32_t node, std::uint32_t cost, std::uint32_t next,
                      const Cell& entry) noexcept {
  if (!doubts_ && is_doubtful(node)) return;
  Node& n = node_[node];
  if (is_settled(node) || (n.reached == search_ && cost >= n.cost)) return;
  if (!reached_.push((std::uint64_t{cost} << 32U) | node)) {
    overflown_ = true;
    return;
  }
  if (n.reached != search_) node_pool_.use(++reached_count_);
  n = {cost, next, entry, search_, n.settled};
}

void WayMemory::relax_uniform(std::uint32_t node, const Cell& block, unsigned room) noexcept {
  const Node& n = node_[node];
  const double metre = price(node, room);
  for (std::size_t face = 0; face < kFaces; ++face) {
    const Cell next{block.x + kStep[face].x, block.y + kStep[face].y, block.z + kStep[face].z};
    if (!in_search(next)) continue;
    const std::uint32_t position = position_of(next);
    const std::int32_t kind = kind_at(position);
    const Cell corner{kBlockCells * next.x, kBlockCells * next.y, kBlockCells * next.z};
    if (kind == kClosed) continue;
    if (kind < 0) {
      // The middle of their common face.
      const auto middle = [face](std::size_t axis, std::int32_t c) {
        return c + (face / 2 != axis ? 8 : face % 2 == 0 ? 0 : 15);
      };
      const Cell door{middle(0, corner.x), middle(1, corner.y), middle(2, corner.z)};
      reach(position, n.cost + step_cost(n.entry, door, metre), node, door);
      continue;
    }
    const Block& b = block_[static_cast<std::size_t>(kind)];
    const std::size_t back = face ^ 1U;
    for (std::size_t i = 0; i < b.doors[back]; ++i) {
      const Door& d = b.door[back][i];
      const Cell door{corner.x + d.x, corner.y + d.y, corner.z + d.z};
      reach(node_of(position, d.room), n.cost + step_cost(n.entry, door, metre), node, door);
    }
  }
}

void WayMemory::relax_rooms(std::uint32_t node, const Block& b, unsigned room) noexcept {
  const Node& n = node_[node];
  const double metre = price(b.position, room);
  const Cell block = block_at(b.position);
  const Cell corner{kBlockCells * block.x, kBlockCells * block.y, kBlockCells * block.z};
  for (std::size_t face = 0; face < kFaces; ++face) {
    const auto& by = kStep[face];
    const Cell next{block.x + by.x, block.y + by.y, block.z + by.z};
    if (!in_search(next)) continue;
    for (std::size_t i = 0; i < b.doors[face]; ++i) {
      const Door& d = b.door[face][i];
      if (d.room != room) continue;
      const Cell door{corner.x + d.x + by.x, corner.y + d.y + by.y, corner.z + d.z + by.z};
      reach(node_of(position_of(next), d.other), n.cost + step_cost(n.entry, door, metre), node, door);
    }
  }
  for (std::size_t i = 0; i < b.doors[kInside]; ++i) {
    const Door& d = b.door[kInside][i];
    if (d.room != room && d.other != room) continue;
    const Cell door{corner.x + d.x, corner.y + d.y, corner.z + d.z};
    const unsigned other = d.room == room ? d.other : d.room;
    reach(node_of(b.position, other), n.cost + step_cost(n.entry, door, metre), node, door);
  }
}

void WayMemory::relax(std::uint32_t node) noexcept {
  if (node < position_.size())
    return relax_uniform(node, block_at(node), kind_at(node) == kKnown ? 1U : kFirstOpenRoom);
  const std::size_t index = node - position_.size();
  relax_rooms(node, block_[index / kRooms], static_cast<unsigned>(index % kRooms));
}

bool WayMemory::seed(const Vector3& goal_W) noexcept {
  Cell goal{};
  const bool near = nearest_room(goal_W, goal);
  if (!near) goal = place_of(goal_W);
  const Cell block{goal.x >> 4, goal.y >> 4, goal.z >> 4};
  if (in_search(block)) {
    if (!near) return false;
    reach(node_of(position_of(block), room_at(goal)), 0, kNowhere, goal);
    return true;
  }
  return seed_border(goal_W);
}

bool WayMemory::seed_border(const Vector3& goal_W) noexcept {
  const auto at_border = [](std::int32_t c, std::int32_t low, std::int32_t high, std::int32_t size) {
    return (c == low && c > 0) || (c == high && c < size - 1);
  };
  bool any = false;
  for (std::int32_t z = low_.z; z <= high_.z; ++z) {
    for (std::int32_t y = low_.y; y <= high_.y; ++y) {
      const bool row = at_border(y, low_.y, high_.y, size_.y) || at_border(z, low_.z, high_.z, size_.z);
      for (std::int32_t x = low_.x; x <= high_.x; x += row ? 1 : std::max(high_.x - low_.x, 1)) {
        const std::uint32_t position = position_of({x, y, z});
        if ((!row && !at_border(x, low_.x, high_.x, size_.x)) || kind_at(position) != kOpen) continue;
        const Cell middle{kBlockCells * x + 8, kBlockCells * y + 8, kBlockCells * z + 8};
        const double rest_m = kUnknownWeight * (goal_W - at_W(middle)).norm();
        reach(position, static_cast<std::uint32_t>(std::fmin(rest_m / kCost_m, 4e8)), kNowhere, middle);
        any = true;
      }
    }
  }
  return any;
}

Status WayMemory::search(const Cell& start, const Vector3& goal_W, core::StageBudget& budget,
                         core::Work& work) noexcept {
  begin_again();
  reached_count_ = 0;
  const std::uint32_t first =
      node_of(position_of({start.x >> 4, start.y >> 4, start.z >> 4}), room_at(start));
  if (!seed(goal_W)) return Status::kGoalBlocked;
  std::uint32_t until = kFar;
  for (std::uint32_t i = 1; !reached_.empty(); ++i) {
    if (i % kNodesPerPoll == 0 && budget.spent(work)) return Status::kBudgetSpent;
    const std::uint64_t entry = reached_.pop();
    const auto node = static_cast<std::uint32_t>(entry);
    if (entry >> 32U > until) break;
    if (is_settled(node)) continue;
    node_[node].settled = search_;
    work.units += 1;
    if (node == first) until = node_[node].cost + kBeyond;
    relax(node);
  }
  if (is_settled(first)) {
    doubts_ = doubts_ && is_way_doubtful(first);
    return Status::kOk;
  }
  return overflown_ ? Status::kBudgetSpent : Status::kNoPath;
}

bool WayMemory::is_way_doubtful(std::uint32_t node) const noexcept {
  while (node != kNowhere && !is_doubtful(node)) node = node_[node].next;
  return node != kNowhere;
}

Status WayMemory::solve(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                        core::Work& work) noexcept {
  if (seen_low_.x > seen_high_.x) return Status::kNotReady;
  low_ = {std::max(seen_low_.x - 1, 0), std::max(seen_low_.y - 1, 0), std::max(seen_low_.z - 1, 0)};
  high_ = {std::min(seen_high_.x + 1, size_.x - 1), std::min(seen_high_.y + 1, size_.y - 1),
           std::min(seen_high_.z + 1, size_.z - 1)};
  begin_again();
  Cell start{};
  if (!nearest_room(from_W, start)) return Status::kStartBlocked;
  if (!is_finite(goal_W) || !(goal_W.cwiseAbs().maxCoeff() < kMost_m)) return Status::kInvalidArgument;
  Status status = search(start, goal_W, budget, work);
  if (status != Status::kNoPath) return status;
  // Of a room beside the vehicle no way may lead on while one leads on from the vehicle: no proof.
  const unsigned here = room_at(place_of(from_W));
  if (here == 0 || is_doubtful_room(here)) return Status::kStartBlocked;
  status = may_lead(from_W, goal_W, budget, work);
  // What is behind what the map knows proves nothing.
  if (status == Status::kNoPath && is_behind_) return Status::kInfeasible;
  if (status != Status::kInfeasible || doubts_) return status;
  doubts_ = true;
  status = search(start, goal_W, budget, work);
  return status == Status::kNoPath ? Status::kInfeasible : status;
}

double WayMemory::to_goal_m(const Vector3& p_W) const noexcept {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Cell place{};
  if (!nearest_room(p_W, place)) return kInfinity;
  const unsigned room = room_at(place);
  const std::uint32_t position = position_of({place.x >> 4, place.y >> 4, place.z >> 4});
  const Node& n = node_[node_of(position, room)];
  if (n.settled != search_) return kInfinity;
  return kCost_m * n.cost + (at_W(n.entry) - p_W).norm() * price(position, room);
}

std::size_t WayMemory::known_way(const Vector3& from_W, double within_m,
                                 std::span<Vector3> way_W) const noexcept {
  Cell place{};
  if (!nearest_room(from_W, place)) return 0;
  unsigned room = room_at(place);
  std::uint32_t node = node_of(position_of({place.x >> 4, place.y >> 4, place.z >> 4}), room);
  std::size_t count = 0;
  while (count < way_W.size() && is_settled(node)) {
    const bool known = node < position_.size()
                           ? kind_at(node) == kKnown
                           : is_known_room(static_cast<unsigned>((node - position_.size()) % kRooms));
    if (!known) break;
    const Vector3 at = at_W(node_[node].entry);
    if ((at - from_W).norm() > within_m) break;
    way_W[count++] = at;
    if (node_[node].next == kNowhere) break;
    node = node_[node].next;
  }
  return count;
}

}  // namespace roborun::stages
