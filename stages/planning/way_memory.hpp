/// What the vehicle has seen of the ways to its goal: where it fits, what is not known yet, and the least way through
/// both. Dead ends are left by it, and it proves it when there is no way.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/executive/stage_budget.hpp"
#include "core/geometry/fence.hpp"
#include "core/geometry/vector.hpp"
#include "core/memory/least_first.hpp"
#include "core/precision.hpp"
#include "firmware_if/status.hpp"
#include "stages/perception/map_view.hpp"
#include "stages/planning/way_rooms.hpp"
#include "stages/planning/ways.hpp"

namespace roborun::stages {

/// Space is divided into blocks of 16 cells an edge, and the places of a vehicle inside each into rooms: connected places that are
/// known to be free, or that may be. Doors join rooms of neighbouring blocks, and known with open ones. What was seen
/// stays, whatever the map gives up. The search runs from the goal over rooms, known space at its length and open space
/// at kUnknownWeight times its length, until it comes to the vehicle. Where that finds nothing and nothing is proved, it runs
/// once more through doubtful places, too (a cell or two too narrow, not seen whole, or closed only by what is not surely there or vague),
/// which are dear: the vehicle goes there and looks closely. Exact in what is connected (for whole cells), coarse in lengths. Source: Dijkstra (1959), over the regions of Botea, Mueller, Schaeffer, "Near optimal hierarchical
/// path-finding" (2004).
class WayMemory final : public Ways {
 public:
  struct Config {
    Aabb bounds_W{};  ///< The vehicle's centre stays inside.
    double radius_m{0.85};
    double finest_m{kPublishedCell_m};  ///< Edge of its cells: the map's finest, or twice that.
    core::Fence fence{};
    double body_m{};               ///< Radius of the vehicle alone: that there is no way is proved for it.
    std::size_t max_blocks{9100};  ///< That are neither free all over nor unknown all over.
  };
  /// Blocks of the world.
  [[nodiscard]] static double positions(const Config& config) noexcept;
  /// Cells across the vehicle with its room; at most kMostAcross, see find_places().
  [[nodiscard]] static int cells_across(const Config& config) noexcept;
  static constexpr int kMostAcross = 17;
  /// False for worlds of more than 262,144 blocks, more than kMostAcross cells across, or a radius that is less than body_m.
  [[nodiscard]] static bool fits(const Config& config) noexcept;
  [[nodiscard]] static std::size_t arena_bytes(const Config& config) noexcept;
  /// Preconditions, asserted: fits(config), and the arena has arena_bytes().
  WayMemory(const Config& config, core::Arena& arena) noexcept;

  [[nodiscard]] Status look(const MapView& map, const WayLook& look, core::StageBudget& budget,
                            core::Work& work) noexcept override;
  [[nodiscard]] Status solve(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                             core::Work& work) noexcept override;
  /// RT-safe: O(size of the world).
  void forget() noexcept override;
  [[nodiscard]] double to_goal_m(const Vector3& p_W) const noexcept override;
  [[nodiscard]] std::size_t known_way(const Vector3& from_W, double within_m,
                                      std::span<Vector3> way_W) const noexcept override;

 private:
  struct Cell {
    std::int32_t x, y, z;
    [[nodiscard]] bool operator==(const Cell&) const noexcept = default;
  };
  /// From a room of this block to one of the block beyond a face, or (kInside) from a known to an open one.
  struct Door {
    std::uint8_t room{}, other{};
    std::uint8_t x{}, y{}, z{};  ///< A place of `room` beside it.
  };
  static constexpr std::size_t kFaces = 6, kInside = 6;
  /// From a block to the one beyond a face.
  static constexpr std::array<Cell, kFaces> kStep{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  static constexpr std::size_t kDoorsPerFace = 8;
  struct Block {
    WayRooms rooms{};
    std::array<std::array<Door, kDoorsPerFace>, kFaces + 1> door{};
    std::array<std::uint8_t, kFaces + 1> doors{};
    std::uint32_t position{};  ///< Or, of a block that is not in use, the next such one.
    CellRows passable{};       ///< Not proved to be closed.
    CellRows passed{};         ///< Of these, what may_lead() has come to.
  };
  /// All of one kind, or the index of a Block.
  static constexpr std::int32_t kOpen = -1, kKnown = -2, kClosed = -3;
  struct Position {
    std::int32_t kind{kOpen};
    std::uint16_t waited{};  ///< How long the vehicle stood beside it, in kWaitUnit.
    bool is_new{};           ///< In this look; false between looks.
    std::uint64_t digest{};  ///< Of the cells that its places touch, when it was last looked at; 0: never.
  };
  /// A block of the map.
  struct Seen {
    Cell block{-1, -1, -1};
    std::uint64_t revision{};  ///< Of the map, when it was read.
    CellBlock cells{};
    BlockContent content{};
    std::uint64_t digest{};
  };
  static constexpr Nanos kWaitUnit{10'000'000};
  static inline const WayLook kNoLook{.from_W = Vector3::Constant(1e9)};
  static constexpr std::uint32_t kFar = 0xFFFFFFFFU;
  static constexpr std::uint32_t kNowhere = 0xFFFFFFFFU;
  static constexpr double kMost_m = 1e5;  ///< Of any coordinate.
  struct Node {
    std::uint32_t cost{kFar};
    std::uint32_t next{kNowhere};  ///< Towards the goal.
    Cell entry{};                  ///< Place from which the next one is entered.
    std::uint32_t reached{};       ///< Search in which what is above was written.
    std::uint32_t settled{};       ///< Search in which it became final.
  };

  [[nodiscard]] std::uint32_t position_of(const Cell& block) const noexcept {
    return static_cast<std::uint32_t>((block.z * size_.y + block.y) * size_.x + block.x);
  }
  [[nodiscard]] Cell block_at(std::uint32_t position) const noexcept {
    const auto p = static_cast<std::int32_t>(position);
    return {p % size_.x, (p / size_.x) % size_.y, p / (size_.x * size_.y)};
  }
  [[nodiscard]] bool has(const Cell& block) const noexcept {
    return block.x >= 0 && block.y >= 0 && block.z >= 0 && block.x < size_.x && block.y < size_.y &&
           block.z < size_.z;
  }
  [[nodiscard]] Cell place_of(const Vector3& p_W) const noexcept;
  [[nodiscard]] Vector3 at_W(const Cell& place) const noexcept;
  [[nodiscard]] unsigned room_at(const Cell& place) const noexcept;
  /// The same in a block of this kind, of the place `inside` it.
  [[nodiscard]] unsigned room_at(std::int32_t kind, const Cell& inside) const noexcept;
  /// The nearest place that is not closed (known, if there is one), at most two cells away.
  [[nodiscard]] bool nearest_room(const Vector3& p_W, Cell& place) const noexcept;
  [[nodiscard]] std::uint32_t node_of(std::uint32_t position, unsigned room) const noexcept;
  /// The cells of blocks low .. high, and of one more to the far sides: vehicles reach into it. What did not change is not read
  /// again. False: budget spent.
  [[nodiscard]] bool read_window(const MapView& map, const Cell& low, const Cell& high,
                                 core::StageBudget& budget, core::Work& work) noexcept;
  /// What changed of the blocks low .. high, and their doors, as much as fits in one look. False: budget spent.
  [[nodiscard]] bool renew_changed(const Cell& low, const Cell& high, core::StageBudget& budget,
                                   core::Work& work) noexcept;
  /// Blocks of one look have places of their own, and keep them from look to look.
  [[nodiscard]] static std::size_t place_in_window(const Cell& block) noexcept;
  /// A block of the window and the seven that follow it; returns their digest.
  [[nodiscard]] std::uint64_t cells_at(const Cell& block, WayCells& cells) const noexcept;
  void renew(const Cell& block, const WayCells& cells) noexcept;
  void forbid(const Cell& block, WayPlaces& places) const noexcept;
  /// Of a block that changed, and of its neighbours to it.
  void find_doors(const Cell& block) noexcept;
  void find_face_doors(Block& b, const Cell& block, std::size_t face) noexcept;
  void find_inner_doors(Block& b) noexcept;
  [[nodiscard]] Block* take(std::uint32_t position) noexcept;
  void give_back(std::int32_t block) noexcept;
  [[nodiscard]] std::int32_t kind_at(std::uint32_t position) const noexcept {
    return position_[position].kind;
  }

  /// From the goal to the room of `start`: kOk; kGoalBlocked; kBudgetSpent; kNoPath.
  [[nodiscard]] Status search(const Cell& start, const Vector3& goal_W, core::StageBudget& budget,
                              core::Work& work) noexcept;
  /// The way that was found from here leads through a doubtful room.
  [[nodiscard]] bool is_way_doubtful(std::uint32_t node) const noexcept;
  [[nodiscard]] bool is_doubtful(std::uint32_t node) const noexcept {
    return node >= position_.size() &&
           is_doubtful_room(static_cast<unsigned>((node - position_.size()) % kRooms));
  }
  [[nodiscard]] bool seed(const Vector3& goal_W) noexcept;
  /// From where the search ends, straight on.
  [[nodiscard]] bool seed_border(const Vector3& goal_W) noexcept;
  [[nodiscard]] bool is_settled(std::uint32_t node) const noexcept { return node_[node].settled == search_; }
  [[nodiscard]] bool in_search(const Cell& b) const noexcept {
    return b.x >= low_.x && b.y >= low_.y && b.z >= low_.z && b.x <= high_.x && b.y <= high_.y &&
           b.z <= high_.z;
  }
  void reach(std::uint32_t node, std::uint32_t cost, std::uint32_t next, const Cell& entry) noexcept;
  void relax(std::uint32_t node) noexcept;
  void relax_uniform(std::uint32_t node, const Cell& block, unsigned room) noexcept;
  void relax_rooms(std::uint32_t node, const Block& b, unsigned room) noexcept;
  /// Of a metre in a room.
  [[nodiscard]] double price(std::uint32_t position, unsigned room) const noexcept;
  [[nodiscard]] std::uint32_t step_cost(const Cell& from, const Cell& to, double price) const noexcept;
  void wait_at(const WayLook& look) noexcept;

  /// Of a block: where the body may fit, by what is surely occupied. What of it nobody has seen joins the open places: it may turn out to have room.
  [[nodiscard]] CellRows find_passable(const Cell& block, const WayCells& cells,
                                       const WayCells& cells_if_sure, WayPlaces& places) const noexcept;
  /// kNoPath: none of what may be passable leads from one to the other, within what was seen; kInfeasible: some does;
  /// kBudgetSpent.
  [[nodiscard]] Status may_lead(const Vector3& from_W, const Vector3& goal_W, core::StageBudget& budget,
                                core::Work& work) noexcept;
  /// The k-th of those that count as the same place.
  [[nodiscard]] static Cell near(const Cell& place, std::int32_t k) noexcept;
  void begin_again() noexcept;
  /// A place on the way to `to`. False: outside the search.
  [[nodiscard]] bool begin_at(const Cell& place, const Cell& to) noexcept;
  /// From where it began. kNoPath: to everything that can be come to, and not near `place`; kInfeasible: to there, too;
  /// kNotReady: to what nobody has seen; kBudgetSpent.
  [[nodiscard]] Status spread_to(const Cell& place, core::StageBudget& budget, core::Work& work) noexcept;
  /// A block that `rows` of may be come to from beside it.
  void pass_into(const Cell& block, const CellRows& rows, const Cell& goal) noexcept;
  /// From a block to the six beside it.
  void pass_on(const Cell& block, const Cell& goal) noexcept;
  [[nodiscard]] bool has_passed(const Cell& place) const noexcept;
  /// Never seen, and the world goes on.
  [[nodiscard]] bool passes_beyond(const Cell& block) const noexcept;
  /// The place of the cube in the middle of the body.
  [[nodiscard]] Cell core_at(const Vector3& p_W) const noexcept;

  Config config_;
  int width_;         ///< Of the vehicle, in cells.
  int narrow_width_;  ///< Of what may turn out to have room for it: see WayPlaces::doubtful.
  int core_width_;    ///< Of what surely fits inside the body, however a gap lies.
  Cell corner_{};     ///< First cell of the first block, in cells from the world's origin.
  Cell size_{};       ///< Blocks.
  std::span<Position> position_;
  core::PoolRecord& position_pool_;
  std::size_t seen_count_{};
  std::span<Block> block_;
  core::PoolRecord& block_pool_;
  std::uint32_t free_{};  ///< First of the blocks that are not in use.
  std::size_t block_count_{};
  std::array<Cell, 512> changed_{};  ///< In this look: no more blocks than that are read anew in one.
  bool is_behind_{false};            ///< The last look left blocks that have changed for the next one.
  std::size_t turn_{0};              ///< Of the blocks of a look, the one that the next one begins with.
  std::span<Seen> window_;
  core::PoolRecord& window_pool_;
  std::span<Node> node_;  ///< Those of positions, then kRooms of each block.
  core::PoolRecord& node_pool_;
  std::size_t reached_count_{};
  std::uint32_t search_{0};
  core::LeastFirst reached_;
  bool overflown_{};
  bool doubts_{};  ///< The search takes doubtful rooms, too: without them there was no way.
  WayLook last_look_ = kNoLook;
  Cell seen_low_{0, 0, 0}, seen_high_{-1, -1, -1};  ///< Of all blocks looked at.
  Cell low_{}, high_{};                             ///< What the search runs in.
};

}  // namespace roborun::stages
