/// The occupancy map of the project: bricks on the precision lattice, in fixed memory. A brick that is free
/// all over needs no memory but its place in the table of positions.
///
/// Free space is found projectively, coarse to fine: a block all of whose pixels see past it is free at once,
/// a block behind the surface is left alone, the rest is divided until cells of p0. Surfaces are the pixels'
/// end points, written at the finest level whatever p0 is: what a coarse block around them hides stays
/// unknown, hence not free, until a finer look clears it. Only where p0 is a brick (4.8 m) or more, and where
/// nothing is known, it is enough to note that a brick of which nothing is known has a surface: unknown is
/// not free either. Free evidence is written first, surfaces after it, so that a look past a cell never
/// erases a surface seen in the same scan.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "core/memory/arena.hpp"
#include "core/precision.hpp"
#include "core/vehicle_model.hpp"
#include "stages/perception/block_sight.hpp"
#include "stages/perception/brick.hpp"
#include "stages/perception/cloud_images.hpp"
#include "stages/perception/depth_pyramid.hpp"
#include "stages/perception/frame_guard.hpp"
#include "stages/perception/hole_reach.hpp"
#include "stages/perception/image_lines.hpp"
#include "stages/perception/occupancy_map.hpp"
#include "stages/perception/pixel_kinds.hpp"
#include "stages/perception/scan_history.hpp"

namespace roborun::stages {

class BrickMap final : public OccupancyMap, private MapView {
 public:
  struct Config {
    /// Space outside is never stored: unknown.
    Aabb bounds_W{Vector3(-100.0, -100.0, -5.0), Vector3(100.0, 100.0, 20.0)};
    PrecisionLattice lattice{};    ///< Finest cells of [0.05, 0.3] m.
    std::size_t max_bricks{9100};  ///< 1,000,000 m3 at 0.3 m. [64, 200000]
    std::size_t max_frames{6};     ///< Of one scan. [1, 8]
    /// So many images of cameras together see every direction: then what lies between two of them is seen, too.
    /// 0: the cameras do not see all around. (The images of a cloud do.) [0, max_frames]
    std::size_t all_around_frames{6};
    std::size_t max_image_width{512};   ///< Pixels, of the largest image. [8, 1280]
    std::size_t max_image_height{512};  ///< Pixels, of the largest image. [8, 1280]
    double vehicle_radius_m{
        VehicleModel{}.radius_m};  ///< Where the vehicle is, nothing else is: free. [0, 2]
    /// The thinnest thing that must not be forgotten once it was seen. [0.005, 1]
    double thinnest_m{VehicleModel{}.thinnest_m};
    /// kInvalidArgument if a number is out of range, or the bounds hold more than 4 million bricks.
    [[nodiscard]] Status validate() const noexcept;
  };
  /// Never decrease.
  struct Counters {
    std::uint64_t scans{}, frames_refused{}, bricks_given_up{}, bricks_refused{};
  };

  /// Bytes that the constructor takes from the arena.
  [[nodiscard]] static std::size_t arena_bytes(const Config& config) noexcept;
  /// Preconditions: config.validate() is kOk, asserted, and the arena has arena_bytes(). Check arena.exhausted()
  /// afterwards.
  BrickMap(const Config& config, core::Arena& arena) noexcept;

  [[nodiscard]] Status integrate(const IntegrationRequest& request, core::StageBudget& budget,
                                 IntegrationResult& result) noexcept override;
  [[nodiscard]] Status export_view(const ExportRequest& request, core::StageBudget& budget,
                                   core::Work& work) noexcept override;
  void forget() noexcept override;
  [[nodiscard]] const MapView& view() const noexcept override { return *this; }
  [[nodiscard]] std::uint64_t saw_through(MonotonicTime now,
                                          std::span<const Vector3> center_W) const noexcept override {
    return history_.saw_through(now, center_W);
  }
  [[nodiscard]] double known_volume_m3() const noexcept override;
  [[nodiscard]] std::size_t bytes() const noexcept override;
  [[nodiscard]] std::uint64_t digest() const noexcept override;
  [[nodiscard]] std::uint64_t refusals() const noexcept override { return counters_.bricks_refused; }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  /// Of bytes(): what the known space of now needs, its share of the table of positions included.
  [[nodiscard]] std::size_t used_bytes() const noexcept;
  [[nodiscard]] std::uint64_t known_cells() const noexcept { return known_cells_; }

 private:
  struct Cell {
    std::int32_t x, y, z;
    [[nodiscard]] bool operator==(const Cell&) const noexcept = default;
  };
  static constexpr double kOrderStep_m =
      0.5;  ///< Units whose distances differ by less keep their order in space.
  static constexpr int kBlockLevel = kBrickLevel + 1;
  static constexpr std::int32_t kUnknownBrick = -1;
  /// Nothing known but that a look at p0 >= 4.8 m met a surface there: occupied as a brick, unknown below.
  static constexpr std::int32_t kSurfaceBrick = -2;
  /// This and what is less: free all over. How much less says in which scan it was last seen past as a whole.
  static constexpr std::int32_t kFreeBrick = -3;
  static constexpr std::uint64_t kFreeStamps = 1U << 30U;
  struct Node {
    int level;
    std::uint32_t x, y, z;  ///< In cells of `level` from the brick's corner.
  };

  [[nodiscard]] double size_m(int level) const noexcept { return config_.lattice.cell_size_m(level); }
  [[nodiscard]] double brick_m() const noexcept { return size_m(kBrickLevel); }
  [[nodiscard]] double finest_m3() const noexcept {
    const double edge_m = config_.lattice.finest_m;
    return edge_m * edge_m * edge_m;
  }

  // MapView, in place.
  [[nodiscard]] bool is_free(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return box_free(box_W, view_level_, view_radius_m_, lookups);
  }
  [[nodiscard]] bool is_free_at_finest(const Aabb& box_W, std::uint64_t& lookups) const noexcept override {
    return box_free(box_W, 0, std::numeric_limits<double>::infinity(), lookups);
  }
  [[nodiscard]] CellState at(const Vector3& p_W, std::uint64_t& lookups) const noexcept override;
  [[nodiscard]] double cell_m() const noexcept override { return size_m(view_level_); }
  [[nodiscard]] double finest_m() const noexcept override { return config_.lattice.finest_m; }
  [[nodiscard]] BlockContent read(const Vector3& corner_W, double cell_m, CellBlock& cells,
                                  std::uint64_t& lookups) const noexcept override;
  [[nodiscard]] BlockContent read_doubled(const Vector3& corner_W, CellBlock& cells,
                                          std::uint64_t& lookups) const noexcept override;
  [[nodiscard]] std::uint64_t revision(const Vector3& corner_W) const noexcept override;
  /// The block with this corner.
  [[nodiscard]] const Brick* brick_above(const Vector3& corner_W) const noexcept;

  /// The frame with what its holes say.
  [[nodiscard]] firmware_if::DepthFrame with_reach(const PosedDepthFrame& posed) noexcept;
  [[nodiscard]] std::size_t usable_frames(const IntegrationRequest& request,
                                          IntegrationResult& result) noexcept;
  /// Of a frame without any surface: the map has surfaces in its view, so that it is more likely a white
  /// image.
  [[nodiscard]] bool is_white(const PosedDepthFrame& posed, std::span<const Vector3> moved_W) const noexcept;
  /// A unit is what v0 is spent in: a brick, or a block of 2^3 bricks (one cell of the coarsest level) if p0
  /// is that coarse or v0 is enough for everything in reach.
  struct Position {
    std::int32_t x, y, z;
  };
  /// A box around everything that a camera of the scan can see, within the bounds.
  [[nodiscard]] Aabb reach_W() const noexcept;
  [[nodiscard]] std::size_t order_units(const IntegrationRequest& request) noexcept;
  [[nodiscard]] std::size_t unit_index(const Position& unit) const noexcept;
  /// A position as one number, and back: no division.
  [[nodiscard]] std::uint32_t packed(const Position& unit) const noexcept;
  [[nodiscard]] Position unit_at(std::uint32_t packed) const noexcept;
  [[nodiscard]] Vector3 unit_center_W(const Position& unit) const noexcept;
  /// What of a cube lies within the bounds: no more than that is charged to v0.
  [[nodiscard]] double volume_m3(const Vector3& center_W, double edge_m) const noexcept;
  /// Writes free space, unit after unit, until budget or v0 is spent. Returns the units that were done.
  [[nodiscard]] std::size_t clear_units(std::size_t count, const IntegrationRequest& request,
                                        core::StageBudget& budget, core::Work& work) noexcept;
  /// False when the budget was spent on the way.
  [[nodiscard]] bool clear_unit(const Position& unit, std::uint8_t cameras, int finest,
                                core::StageBudget& budget, core::Work& work) noexcept;
  [[nodiscard]] bool clear_block(const Position& block, std::uint8_t cameras, int finest,
                                 core::StageBudget& budget, core::Work& work) noexcept;
  /// Of a brick and p0. What is no wider there than a pixel is not divided: smaller cells tell nothing more, and are eight times as
  /// many.
  [[nodiscard]] int finest_at(const Vector3& center_W, int finest) const noexcept;
  void clear_brick(const Position& at, std::uint8_t cameras, int finest, core::Work& work) noexcept;
  void free_unit(const Position& unit) noexcept;
  void free_brick(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept;
  /// Whether a look past what is in this brick counts for something thin in it: not each look would have met it. A pole of
  /// thinnest_m is a part of thinnest_m / (pitch distance) of a pixel wide, and is met by that part of all looks; it is believed to
  /// be there until it should have been met kThinPatience times: each scan counts near the vehicle, each second one twice as
  /// far, and so on.
  [[nodiscard]] bool counts_for_the_thin(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept {
    return (brick_center_W(bx, by, bz) - vehicle_W_).squaredNorm() < thin_reach_m_ * thin_reach_m_;
  }
  /// A camera whose surfaces are being written.
  struct SurfaceCamera {
    const PosedDepthFrame* posed{};
    double column_pitch{}, row_pitch{};  ///< Of the pixels, at depth 1.
    int level{};  ///< p0. A brick or more: surfaces in unknown bricks are noted, not written.
    PixelLine line{};
    PixelRules kinds{};
    float exact_m{};       ///< Farther away nobody knows in which cell a pixel ends.
    float thin_reach_m{};  ///< What is a pixel wide there may still be a pole; beyond it a body.
    std::span<const Vector3> moved_W{};
    [[nodiscard]] bool is_coarse() const noexcept { return level >= kBrickLevel; }
  };
  /// Of column u and row v of the image, in edges, for a depth of 1.
  [[nodiscard]] static std::array<float, 3> direction(const SurfaceCamera& camera, double u, double v,
                                                      double edge_m) noexcept;
  [[nodiscard]] static bool moved_nearby(std::span<const Vector3> moved_W, const Vector3& p_W) noexcept;
  void add_surfaces(const IntegrationRequest& request, core::Work& work) noexcept;
  /// The pixels [u0, u1) of row v.
  void add_pixels(const SurfaceCamera& camera, std::size_t v, std::size_t u0, std::size_t u1,
                  core::Work& work) noexcept;
  /// The cells in row_.
  void add_cells(const SurfaceCamera& camera, bool vague, core::Work& work) noexcept;
  /// Those of pixels_ that show something thin, but for what lately moved there.
  void add_thin_pixels(const SurfaceCamera& camera, const PixelLine& line) noexcept;
  /// Tile by tile: pixels are looked at where they may end in space of which something was known before.
  void add_tiles(const SurfaceCamera& camera, const DepthPyramid& image, core::Work& work) noexcept;
  /// True if nothing is known of all space in which this tile of tiles_ may end: then that is all to be done.
  [[nodiscard]] bool note_surface(std::size_t tile) noexcept;
  /// Whether something is known of what a brick and the cells [low, high] of a tile share. Not if this scan
  /// saw past the whole brick: no pixel ends there.
  [[nodiscard]] bool knows(const Brick& brick, const Cell& low, const Cell& high) const noexcept;
  [[nodiscard]] Brick* surface_brick(std::int32_t bx, std::int32_t by, std::int32_t bz, bool coarse) noexcept;
  /// Whether v0 reached this brick in this scan.
  [[nodiscard]] bool paid(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept;
  void free_vehicle() noexcept;
  /// IntegrationRequest::assumed_half_m.
  void assume_free(const Vector3& half_m) noexcept;
  [[nodiscard]] bool cell_of(const Vector3& p_W, Cell& cell) const noexcept;
  [[nodiscard]] std::size_t row_of(std::int32_t by, std::int32_t bz) const noexcept {
    return static_cast<std::size_t>(bz) * static_cast<std::size_t>(ny_) + static_cast<std::size_t>(by);
  }
  [[nodiscard]] std::size_t slot_of(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept {
    return row_of(by, bz) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(bx);
  }
  /// No deeper than to cells of `level`; bricks farther than `radius_m` from view_center_W_ are unknown.
  [[nodiscard]] bool box_free(const Aabb& box_W, int level, double radius_m,
                              std::uint64_t& lookups) const noexcept;
  /// Bricks, the last ones included.
  struct Box {
    Cell low, high;
    [[nodiscard]] bool operator==(const Box&) const noexcept = default;
  };
  /// Of a row of positions: the first and the last that was ever known.
  struct Reach {
    std::int32_t first, last;
  };
  void reach_to(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept {
    Reach& row = row_reach_[row_of(by, bz)];
    row = {std::min(row.first, bx), std::max(row.last, bx)};
  }
  static constexpr std::size_t kDistances = 512;
  static constexpr double kDistance_m = 2.4;
  using KnownByDistance = std::array<std::uint64_t, kDistances>;  ///< Cells.
  /// Adds what is known in `box`, but not in `done`, which lies in it. Counts the rows and positions on. False: budget spent.
  [[nodiscard]] bool count_known(const Box& box, const Box& done, std::size_t& positions,
                                 KnownByDistance& known, core::StageBudget& budget,
                                 core::Work& work) const noexcept;
  [[nodiscard]] const Brick* brick_within(std::int32_t bx, std::int32_t by, std::int32_t bz,
                                          double radius_m) const noexcept;
  /// nullptr where nothing is known.
  [[nodiscard]] const Brick* brick_at(std::size_t position) const noexcept;
  [[nodiscard]] Brick* touch(std::int32_t bx, std::int32_t by, std::int32_t bz) noexcept;
  [[nodiscard]] bool give_up_farthest() noexcept;
  [[nodiscard]] bool brick_range_free(const Brick& brick, const Cell& low, const Cell& high, int finest,
                                      std::uint64_t& lookups) const noexcept;
  [[nodiscard]] Vector3 brick_center_W(std::int32_t bx, std::int32_t by, std::int32_t bz) const noexcept;
  void refresh(Brick& brick) noexcept;
  void refresh_dirty() noexcept;

  Config config_;
  Vector3 corner_W_;              ///< Of the map, a multiple of the coarsest cell.
  std::int32_t nx_, ny_, nz_;     ///< Bricks, even numbers.
  Cell low_, high_;               ///< Cells of the bounds.
  std::span<std::int32_t> slot_;  ///< Brick of each position, or what is known without one.
  std::span<Reach> row_reach_;    ///< By row_of().
  std::span<Brick> brick_;
  core::PoolRecord* brick_pool_{nullptr};
  core::PoolRecord* order_pool_{nullptr};
  core::PoolRecord* dirty_pool_{nullptr};
  core::PoolRecord* known_pool_{nullptr};
  std::span<std::uint32_t> free_list_;
  std::span<std::uint32_t> dirty_;
  std::span<std::uint16_t> known_count_;  ///< Of each brick, once more: an export reads them all.
  std::span<std::uint32_t> order_;        ///< Units near the cameras, nearest to the trajectory first.
  std::span<std::uint16_t> order_key_;    ///< Of each unit of the map.
  int unit_level_{kBrickLevel};
  Position first_unit_{}, last_unit_{};  ///< Of those near the cameras.
  std::size_t free_count_{0};
  std::size_t dirty_count_{0};
  FrameGuard guard_{};
  HoleReach reach_{};
  std::span<float> filled_;  ///< An image.
  SightCameras cameras_{};
  ScanHistory history_;
  BrickSeen seen_{};
  PixelRow pixels_{};
  SurfaceRow row_{};
  TileRow tiles_{};
  std::uint64_t revision_{0};
  bool mixes_{
      false};  ///< Some camera's pixels are now and then between two depths: what one look met may be nothing.
  double reach_m_{0.0};    ///< From the trajectory: v0 was spent up to here.
  Brick free_brick_{};     ///< What every free position reads as.
  Brick surface_brick_{};  ///< The same for kSurfaceBrick.
  std::array<std::size_t, kMaxCameras> frame_of_{};
  std::array<std::optional<DepthPyramid>, kMaxCameras> pyramid_{};
  std::uint64_t known_cells_{0};
  std::int32_t free_now_{kFreeBrick};  ///< A slot that is free and was seen past as a whole in this scan.
  Vector3 vehicle_W_ = Vector3::Zero();
  std::uint32_t thin_seen_{0};  ///< Pixels of this scan that showed something thin.
  double thin_reach_m_{0.0};    ///< Of this scan: counts_for_the_thin().
  double least_pitch_{};        ///< Of the finest pixels of this scan, at depth 1.
  int view_level_{0};
  double view_radius_m_{0.0};  ///< Bricks whose centre is farther from view_center_W_ are unknown.
  Vector3 view_center_W_ = Vector3::Zero();
  Counters counters_{};
};

}  // namespace roborun::stages
