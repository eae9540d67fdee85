#include "platform/sitl/judge/way_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <queue>

#include "platform/input/input_error.hpp"

namespace roborun::sitl {
namespace {

constexpr double kShortest_m = 1e-3;  // of a line that is not divided any more
constexpr double kExact_m = 1e-6;
constexpr double kSlack_m = 0.01;
constexpr std::uint64_t kReport = 1U << 16U;
constexpr double kQuickPlaces = 8e6;  // some seconds

using Index = std::int64_t;
constexpr std::int32_t kNone = -1;

/// What a search knows of a place.
struct Place {
  float clearance_m{-1.0F};  ///< Below 0: not looked at yet.
  float value{};             ///< Length of the way, or width; meaning is the search's.
  std::int32_t parent{kNone};
  bool seen{false};
  bool closed{false};
};

/// All places of the lattice in the bounds, made as they are looked at, and two more: start and goal.
class Lattice {
 public:
  Lattice(const World& world, double step_m) : world_(world), step_m_(step_m) {
    const Aabb& b = world.bounds_W();
    Index total = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      first_[i] = static_cast<Index>(std::ceil(b.min_W[axis] / step_m - 1e-9));
      count_[i] =
          std::max<Index>(static_cast<Index>(std::floor(b.max_W[axis] / step_m + 1e-9)) - first_[i] + 1, 0);
      total *= count_[i];
    }
    start_ = total;
    blocks_.resize(static_cast<std::size_t>(total / kBlock + 1));
  }

  [[nodiscard]] Index start() const { return start_; }
  [[nodiscard]] Index goal() const { return start_ + 1; }
  [[nodiscard]] std::uint64_t places() const { return places_; }
  [[nodiscard]] Vector3 position_W(Index index) const {
    if (index >= start_) return index == start_ ? world_.start_W() : world_.goal_W();
    const Index x = index % count_[0];
    const Index y = index / count_[0] % count_[1];
    const Index z = index / count_[0] / count_[1];
    return place_W(x, y, z);
  }
  [[nodiscard]] Place& at(Index index) {
    if (index >= start_) return ends_[static_cast<std::size_t>(index - start_)];
    auto& block = blocks_[static_cast<std::size_t>(index / kBlock)];
    if (!block) block = std::make_unique<std::array<Place, kBlock>>();
    return (*block)[static_cast<std::size_t>(index % kBlock)];
  }
  [[nodiscard]] double clearance_m(Index index) { return clearance_m(index, position_W(index)); }
  /// The same, where the caller knows its position.
  [[nodiscard]] double clearance_m(Index index, const Vector3& p_W) {
    Place& place = at(index);
    if (place.clearance_m < 0.0F) {
      ++places_;
      // Rounded to float downwards by less than a micrometre.
      place.clearance_m = static_cast<float>(exact_m(p_W));
    }
    return static_cast<double>(place.clearance_m);
  }
  [[nodiscard]] double exact_m(const Vector3& p_W) const { return world_.clearance_m(p_W, kWidest_m); }
  /// Calls with each neighbour: the 26 around a place; around start and goal all places of the next two steps.
  template <typename Function>
  void each_neighbour(Index index, Function&& call) {
    const bool end = index >= start_;
    const Vector3 at_W = position_W(index);
    const Index reach = end ? 2 : 1;
    std::array<Index, 3> low{};
    std::array<Index, 3> high{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto middle =
          static_cast<Index>(std::llround(at_W[static_cast<Eigen::Index>(i)] / step_m_)) - first_[i];
      low[i] = std::max<Index>(middle - reach, 0);
      high[i] = std::min<Index>(middle + reach, count_[i] - 1);
    }
    for (Index z = low[2]; z <= high[2]; ++z)
      for (Index y = low[1]; y <= high[1]; ++y) {
        const Index row = (z * count_[1] + y) * count_[0];
        for (Index x = low[0]; x <= high[0]; ++x)
          if (row + x != index) call(row + x, place_W(x, y, z));
      }
    for (const Index other : {start(), goal()}) {
      const Vector3& other_W = other == start_ ? world_.start_W() : world_.goal_W();
      if (other != index && (other_W - at_W).cwiseAbs().maxCoeff() <= 2.5 * step_m_) call(other, other_W);
    }
  }
  /// A search begins again: what it knew is forgotten, clearances stay.
  void forget() {
    const auto clear = [](Place& p) { p = {p.clearance_m, 0.0F, kNone, false, false}; };
    for (auto& block : blocks_)
      if (block) std::for_each(block->begin(), block->end(), clear);
    std::for_each(ends_.begin(), ends_.end(), clear);
  }

 private:
  [[nodiscard]] Vector3 place_W(Index x, Index y, Index z) const {
    return step_m_ * Vector3(static_cast<double>(first_[0] + x), static_cast<double>(first_[1] + y),
                             static_cast<double>(first_[2] + z));
  }
  static constexpr Index kBlock = 4096;
  const World& world_;
  double step_m_;
  std::array<Index, 3> first_{};
  std::array<Index, 3> count_{};
  Index start_{};
  std::vector<std::unique_ptr<std::array<Place, kBlock>>> blocks_;
  std::array<Place, 2> ends_{};
  std::uint64_t places_{0};
};

/// The least clearance there can be between two places `length_m` apart whose own clearances are a and b: what is solid is
/// outside of both balls, and nearest to the line where they meet.
double least_between_m(double a_m, double b_m, double length_m) {
  const double meet_m = (length_m * length_m + a_m * a_m - b_m * b_m) / (2.0 * length_m);
  if (!(meet_m > 0.0 && meet_m < length_m)) return std::min(a_m, b_m);
  return std::sqrt(std::max(a_m * a_m - meet_m * meet_m, 0.0));
}

enum class Part : std::uint8_t { kKnown, kDivide, kStop };

struct End {
  Vector3 p_W;
  double clearance_m;
};

/// Divides the line from a to b until `is_known` says of each part that its ends tell enough; false as soon as it says
/// that no more is asked for. Parts come in order.
template <typename Function>
bool divide(const Lattice& lattice, const End& a, const End& b, Function&& is_known) {
  constexpr std::size_t kDeepest = 40;
  std::array<End, kDeepest> waiting;  // far ends of the parts to come
  std::size_t count = 0;
  End from = a;
  waiting[count++] = b;
  while (count > 0) {
    const End& to = waiting[count - 1];
    const Part part = is_known(from, to);
    if (part == Part::kStop) return false;
    if (part == Part::kDivide && count < kDeepest) {
      const Vector3 middle_W = 0.5 * (from.p_W + to.p_W);
      waiting[count++] = {middle_W, lattice.exact_m(middle_W)};
      continue;
    }
    from = to;
    --count;
  }
  return true;
}
/// Whether a ball gets straight from a to b, to kSlack_m. Where the ends alone do not tell, the middle is looked at.
bool is_free(const Lattice& lattice, const End& a, const End& b, double radius_m) {
  const double enough_m = radius_m - std::min(kSlack_m, 0.05 * radius_m);
  return divide(lattice, a, b, [&](const End& from, const End& to) {
    if (std::min(from.clearance_m, to.clearance_m) < radius_m - kExact_m) return Part::kStop;
    const double least_m = least_between_m(from.clearance_m, to.clearance_m, (to.p_W - from.p_W).norm());
    return least_m >= enough_m ? Part::kKnown : Part::kDivide;
  });
}

/// The least clearance between a and b, as long as it is below `most_m`; to a millimetre.
double width_m(const Lattice& lattice, const End& a, const End& b, double most_m) {
  (void)divide(lattice, a, b, [&](const End& from, const End& to) {
    most_m = std::min({most_m, from.clearance_m, to.clearance_m});
    const double length_m = (to.p_W - from.p_W).norm();
    const double least_m = least_between_m(from.clearance_m, to.clearance_m, length_m);
    return length_m < kShortest_m || least_m >= most_m - kShortest_m ? Part::kKnown : Part::kDivide;
  });
  return most_m;
}

std::vector<Vector3> way_to(Lattice& lattice, Index index) {
  std::vector<Vector3> way_W;
  for (; index != kNone; index = lattice.at(index).parent) way_W.push_back(lattice.position_W(index));
  std::reverse(way_W.begin(), way_W.end());
  return way_W;
}

class Progress {
 public:
  Progress(const std::function<void(std::uint64_t)>& call, const Lattice& lattice)
      : call_(call), lattice_(lattice) {}
  void tick() {
    if (++ticks_ % kReport == 0 && call_) call_(lattice_.places());
  }

 private:
  const std::function<void(std::uint64_t)>& call_;
  const Lattice& lattice_;
  std::uint64_t ticks_{0};
};

/// The widest way: always on from the widest place reached so far, the nearest to the goal among equals.
void find_widest(Lattice& lattice, Progress& progress, WayVerdict& verdict) {
  struct Entry {
    float width_m;
    float to_goal_m;
    Index index;
    bool operator<(const Entry& o) const {
      if (width_m != o.width_m) return width_m < o.width_m;
      return to_goal_m != o.to_goal_m ? to_goal_m > o.to_goal_m : index > o.index;
    }
  };
  std::priority_queue<Entry> open;
  const Vector3 goal_W = lattice.position_W(lattice.goal());
  const auto offer = [&](Index index, double width, Index parent) {
    Place& place = lattice.at(index);
    const auto value = static_cast<float>(width);
    if (place.closed || !(value > 0.0F) || (place.seen && value <= place.value)) return;
    place.seen = true;
    place.value = value;
    place.parent = static_cast<std::int32_t>(parent);
    open.push({value, static_cast<float>((lattice.position_W(index) - goal_W).norm()), index});
  };
  offer(lattice.start(), lattice.clearance_m(lattice.start()), kNone);
  while (!open.empty()) {
    progress.tick();
    const Entry entry = open.top();
    open.pop();
    Place& place = lattice.at(entry.index);
    if (place.closed) continue;
    place.closed = true;
    if (entry.index == lattice.goal()) break;
    const Vector3 here_W = lattice.position_W(entry.index);
    const double here_m = lattice.clearance_m(entry.index);
    lattice.each_neighbour(entry.index, [&](Index next, const Vector3& next_W) {
      const Place& other = lattice.at(next);
      if (other.closed) return;
      const double next_m = lattice.clearance_m(next, next_W);
      const double bound = std::min({static_cast<double>(entry.width_m), here_m, next_m});
      if (other.seen && static_cast<float>(bound) <= other.value) return;
      // What the two ends prove is enough to choose by; the way that is found is measured after.
      offer(next, std::min(bound, least_between_m(here_m, next_m, (next_W - here_W).norm())), entry.index);
    });
  }
  if (!lattice.at(lattice.goal()).closed) return;
  verdict.widest_W = way_to(lattice, lattice.goal());
  double least_m = kWidest_m;
  for (std::size_t i = 1; i < verdict.widest_W.size(); ++i) {
    const Vector3& a_W = verdict.widest_W[i - 1];
    const Vector3& b_W = verdict.widest_W[i];
    const double m = width_m(lattice, {a_W, lattice.exact_m(a_W)}, {b_W, lattice.exact_m(b_W)}, least_m);
    if (m < least_m) verdict.narrowest_W = 0.5 * (a_W + b_W);
    least_m = std::min(least_m, m);
  }
  verdict.narrowest_m = 2.0 * least_m;
}

bool sees(const Lattice& lattice, const Vector3& a_W, const Vector3& b_W, double radius_m) {
  return is_free(lattice, {a_W, lattice.exact_m(a_W)}, {b_W, lattice.exact_m(b_W)}, radius_m);
}

/// Corners that are not needed are left out.
void pull(const Lattice& lattice, double radius_m, std::vector<Vector3>& way_W) {
  std::vector<Vector3> pulled{way_W.front()};
  std::size_t at = 0;
  while (at + 1 < way_W.size()) {
    std::size_t next = way_W.size() - 1;
    while (next > at + 1 && !sees(lattice, way_W[at], way_W[next], radius_m)) --next;
    pulled.push_back(way_W[next]);
    at = next;
  }
  way_W = std::move(pulled);
}

/// The shortest way at any angle: a place's parent is the last corner of its way, believed to see it until it is its turn.
void find_shortest(Lattice& lattice, double radius_m, Progress& progress, WayVerdict& verdict) {
  struct Entry {
    double estimate_m;
    double length_m;
    Index index;
    bool operator<(const Entry& o) const {
      if (estimate_m != o.estimate_m) return estimate_m > o.estimate_m;
      return length_m != o.length_m ? length_m < o.length_m : index > o.index;
    }
  };
  verdict.shortest_m = std::numeric_limits<double>::infinity();
  std::priority_queue<Entry> open;
  const Vector3 goal_W = lattice.position_W(lattice.goal());
  const auto fits = [&](Index index, const Vector3& p_W) {
    return lattice.clearance_m(index, p_W) >= radius_m - kExact_m;
  };
  const auto offer = [&](Index index, const Vector3& p_W, double length_m, Index parent) {
    Place& place = lattice.at(index);
    if (place.closed || (place.seen && length_m >= static_cast<double>(place.value))) return;
    place.seen = true;
    place.value = static_cast<float>(length_m);
    place.parent = static_cast<std::int32_t>(parent);
    const auto value = static_cast<double>(place.value);
    open.push({value + (p_W - goal_W).norm(), value, index});
  };
  if (!fits(lattice.start(), lattice.position_W(lattice.start())) || !fits(lattice.goal(), goal_W)) return;
  offer(lattice.start(), lattice.position_W(lattice.start()), 0.0, kNone);
  while (!open.empty()) {
    progress.tick();
    const Entry entry = open.top();
    open.pop();
    const Index index = entry.index;
    Place& place = lattice.at(index);
    if (place.closed || entry.length_m != static_cast<double>(place.value)) continue;
    const Vector3 here_W = lattice.position_W(index);
    const double here_m = lattice.clearance_m(index);
    if (place.parent != kNone &&
        !is_free(lattice, {lattice.position_W(place.parent), lattice.clearance_m(place.parent)},
                 {here_W, here_m}, radius_m)) {
      // It does not: the best of the neighbours that are done with, then.
      double best_m = std::numeric_limits<double>::infinity();
      Index best = kNone;
      lattice.each_neighbour(index, [&](Index next, const Vector3& next_W) {
        const Place& other = lattice.at(next);
        if (!other.closed) return;
        const double length_m = static_cast<double>(other.value) + (next_W - here_W).norm();
        if (length_m >= best_m ||
            !is_free(lattice, {next_W, lattice.clearance_m(next, next_W)}, {here_W, here_m}, radius_m))
          return;
        best_m = length_m;
        best = next;
      });
      place = {place.clearance_m, std::numeric_limits<float>::infinity(), kNone, false, false};
      if (best != kNone) offer(index, here_W, best_m, best);
      if (best == kNone || best_m > entry.length_m + 1e-3) continue;  // its turn comes again
    }
    place.closed = true;
    if (index == lattice.goal()) break;
    const Index corner = place.parent == kNone ? index : place.parent;
    const Vector3 corner_W = lattice.position_W(corner);
    const auto corner_m = static_cast<double>(lattice.at(corner).value);
    lattice.each_neighbour(index, [&](Index next, const Vector3& next_W) {
      if (lattice.at(next).closed || !fits(next, next_W)) return;
      offer(next, next_W, corner_m + (next_W - corner_W).norm(), corner);
    });
  }
  if (!lattice.at(lattice.goal()).closed) return;
  verdict.way = true;
  verdict.way_W = way_to(lattice, lattice.goal());
  pull(lattice, radius_m, verdict.way_W);
  verdict.shortest_m = 0.0;
  for (std::size_t i = 1; i < verdict.way_W.size(); ++i)
    verdict.shortest_m += (verdict.way_W[i] - verdict.way_W[i - 1]).norm();
}

double places_of(const World& world, double step_m) {
  return world.bounds_W().size().prod() / (step_m * step_m * step_m);
}

/// Coarse ones first, which large worlds need; finer ones where those find no way.
std::vector<double> resolutions_for(const World& world, double radius_m) {
  double step_m = 0.2;
  while (step_m > radius_m / 3.0 && step_m > 0.03) step_m *= 0.5;
  while (places_of(world, step_m) > kMostPlaces) step_m *= 2.0;
  std::vector<double> steps_m{step_m};
  for (; places_of(world, step_m) > kQuickPlaces && step_m < radius_m; steps_m.push_back(step_m))
    step_m *= 2.0;
  std::reverse(steps_m.begin(), steps_m.end());
  return steps_m;
}

}  // namespace

WayVerdict judge_way(const World& world, const WayQuestion& question) {
  const double radius_m = question.radius_m;
  if (!(radius_m > 0.0 && radius_m < kWidest_m))
    throw InputError(
        fmt::format("radius and margin: {} must be above 0 and below {} m", radius_m, kWidest_m));
  std::vector<double> steps_m{question.resolution_m};
  if (question.resolution_m == 0.0) steps_m = resolutions_for(world, radius_m);
  if (!(steps_m.back() >= 0.01 && steps_m.back() <= 5.0 &&
        places_of(world, steps_m.back()) < 4.0 * kMostPlaces))
    throw InputError(fmt::format("resolution: {} must be from 0.01 to 5 m, and coarser for so large a world",
                                 steps_m.back()));
  WayVerdict verdict;
  for (const double step_m : steps_m) {
    const std::uint64_t before = verdict.places;
    verdict = {};
    verdict.resolution_m = step_m;
    Lattice lattice(world, step_m);
    Progress progress(question.progress, lattice);
    find_shortest(lattice, radius_m, progress, verdict);
    if (verdict.way || step_m == steps_m.back()) {
      lattice.forget();
      find_widest(lattice, progress, verdict);
    }
    verdict.places = before + lattice.places();
    if (verdict.way) break;
  }
  return verdict;
}

}  // namespace roborun::sitl
