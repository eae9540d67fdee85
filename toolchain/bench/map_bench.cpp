// Own map against stock OctoMap on the same images. Ends with one line of JSON: see README.md of stages/perception.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/precision.hpp"
#include "stages/perception/brick_map.hpp"
#include "stages/perception/point_cloud.hpp"
#include "tests/support/no_alloc_scope.hpp"
#include "toolchain/bench/map_plot.hpp"
#include "toolchain/bench/stock_octomap.hpp"

namespace roborun::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMovingScans = 3;
bool once = false;  // --once: one repetition, for callgrind
constexpr std::array<StockMode, 4> kModes{StockMode::kPlain, StockMode::kLazy, StockMode::kDiscretised,
                                          StockMode::kBoth};

/// Time of this thread alone: the machine may be shared.
double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The own map and its memory, large enough for everything that the longest range reaches.
class OwnMap {
 public:
  explicit OwnMap(int pixels, double range_m) {
    config_.bounds_W = {Vector3(-1.8 * range_m, -1.8 * range_m, -9.6),
                        Vector3(1.8 * range_m + 10.0, 1.8 * range_m, 1.8 * range_m + 9.6)};
    config_.max_bricks = range_m > 30.0 ? 30000 : 9100;
    config_.max_image_width = config_.max_image_height = static_cast<std::size_t>(pixels);
    block_.resize(stages::BrickMap::arena_bytes(config_));
    reset();
  }
  void reset() {
    map_.reset();
    arena_.emplace(block_);  // the map keeps a record of its pool in it
    map_ = std::make_unique<stages::BrickMap>(config_, *arena_);
    if (arena_->exhausted()) std::abort();
  }
  std::uint64_t integrate(const Scan& scan, int level) {
    const std::array<Vector3, 1> here{scan.p_WB()};
    core::UnlimitedBudget unlimited;
    stages::IntegrationResult result;
    if (map_->integrate({scan.frames(), level, kInfinity, here}, unlimited, result) != Status::kOk)
      std::abort();
    return result.work.units;
  }
  const stages::MapView& view() {
    core::UnlimitedBudget unlimited;
    core::Work work;
    (void)map_->export_view({0, kInfinity, Vector3::Zero()}, unlimited, work);
    return map_->view();
  }
  [[nodiscard]] double known_m3() const { return map_->known_volume_m3(); }
  /// Memory that the known space needs, for each cell of it.
  [[nodiscard]] double bytes_per_cell() const {
    return static_cast<double>(map_->used_bytes()) / static_cast<double>(map_->known_cells());
  }

 private:
  stages::BrickMap::Config config_;
  std::vector<std::byte> block_;
  std::optional<core::Arena> arena_;
  std::unique_ptr<stages::BrickMap> map_;
};

const Scan& scan_of(int n, int pixels, int range_m) {
  static std::map<std::tuple<int, int, int>, std::unique_ptr<Scan>> scans;
  std::unique_ptr<Scan>& scan = scans[{n, pixels, range_m}];
  if (!scan) scan = std::make_unique<Scan>(pillar_world(), n, pixels, range_m);
  return *scan;
}

OwnMap& own_map(int pixels, int range_m) {
  static std::map<std::pair<int, int>, std::unique_ptr<OwnMap>> maps;
  std::unique_ptr<OwnMap>& map = maps[{pixels, range_m}];
  if (!map) map = std::make_unique<OwnMap>(pixels, range_m);
  return *map;
}

struct Case {
  int level;
  int range_m;
  int pixels;
  bool moving;
};

std::string name_of(const std::string& who, const Case& c) {
  char text[96];
  std::snprintf(text, sizeof text, "%s/%s/%.1fm/range%d/%dx%d", who.c_str(), c.moving ? "moving" : "first",
                PrecisionLattice{}.cell_size_m(c.level), c.range_m, c.pixels, c.pixels);
  return text;
}

/// One iteration: scan 0 into an empty map; or, moving, the mean of the scans 1 .. kMovingScans after it. A scan is read
/// before its time begins: in a decision the point cloud stage has just done that, and it prepares what stock gets.
template <typename ResetFunction, typename ReadFunction, typename InsertFunction>
void measure(benchmark::State& state, const Case& c, ResetFunction&& reset, ReadFunction&& read_scan,
             InsertFunction&& insert_scan) {
  std::uint64_t allocations = 0;
  const int scans = c.moving ? kMovingScans : 1;
  for ([[maybe_unused]] auto iteration : state) {
    reset();
    if (c.moving) insert_scan(0);
    const test::NoAllocScope scope;
    double spent_s = 0.0;
    for (int n = 0; n < scans; ++n) {
      const int scan = c.moving ? n + 1 : 0;
      float sum = read_scan(scan);
      benchmark::DoNotOptimize(sum);
      const double begin_s = cpu_s();
      insert_scan(scan);
      spent_s += cpu_s() - begin_s;
    }
    state.SetIterationTime(spent_s / scans);
    allocations = scope.count() / static_cast<std::uint64_t>(scans);
  }
  state.counters["allocations"] = static_cast<double>(allocations);
}

float sum_of(const Scan& scan) {
  float sum = 0.0F;
  for (const stages::PosedDepthFrame& posed : scan.frames())
    for (const float depth_m : posed.frame.depth_m) sum += depth_m;
  return sum;
}

float sum_of(const StockScan& scan) {
  float sum = 0.0F;
  for (const octomap::point3d& point : scan.cloud) sum += point.x();
  return sum;
}

void own(benchmark::State& state, const Case& c) {
  OwnMap& map = own_map(c.pixels, c.range_m);
  for (int n = 0; n <= (c.moving ? kMovingScans : 0); ++n) (void)scan_of(n, c.pixels, c.range_m);
  std::uint64_t units = 0;
  measure(
      state, c, [&] { map.reset(); }, [&](int n) { return sum_of(scan_of(n, c.pixels, c.range_m)); },
      [&](int n) { units = map.integrate(scan_of(n, c.pixels, c.range_m), c.level); });
  state.counters["units"] = static_cast<double>(units);
}

/// The point cloud stage: what the averaging of stock's input would cost.
void cloud(benchmark::State& state, const Case& c) {
  std::vector<std::byte> block(stages::PointCloud::arena_bytes({}));
  std::optional<core::Arena> arena;
  std::unique_ptr<stages::PointCloud> points;
  const Scan& scan = scan_of(0, c.pixels, c.range_m);
  measure(
      state, c,
      [&] {
        arena.emplace(block);
        points = std::make_unique<stages::PointCloud>(stages::PointCloud::Config{}, *arena);
      },
      [&](int) { return sum_of(scan); },
      [&](int) {
        core::UnlimitedBudget unlimited;
        core::Work work;
        if (points->step(scan.frames(), c.level, unlimited, work) != Status::kOk) std::abort();
      });
}

/// At coarse precision stock gets what its pipeline would give it: one mean point a cell, the averaging not counted. Or,
/// `all_pixels`, what the own map gets.
void stock(benchmark::State& state, const Case& c, StockMode mode, bool all_pixels) {
  std::vector<StockScan> scans;
  for (int n = 0; n <= (c.moving ? kMovingScans : 0); ++n)
    scans.push_back(stock_scan(scan_of(n, c.pixels, c.range_m), all_pixels ? 0.0 : PrecisionLattice{}.cell_size_m(c.level)));
  std::unique_ptr<octomap::OcTree> tree;
  measure(
      state, c, [&] { tree = std::make_unique<octomap::OcTree>(PrecisionLattice{}.cell_size_m(c.level)); },
      [&](int n) { return sum_of(scans[static_cast<std::size_t>(n)]); },
      [&](int n) { insert(*tree, scans[static_cast<std::size_t>(n)], mode); });
  state.counters["bytes"] = static_cast<double>(tree->memoryUsage());
}

/// Returns how many were registered.
std::size_t add(const Case& c, bool all_modes) {
  std::size_t registered = 0;
  const auto measure_as = [&](const std::string& who, auto&& function) {
    // The same for all: what takes long at 0.3 m less often.
    const int repetitions = c.level > 2                      ? 60
                            : c.level > 1                    ? 15
                            : c.level > 0 || c.range_m <= 20 ? 10
                            : c.moving                       ? 3
                                                             : 5;
    benchmark::RegisterBenchmark(name_of(who, c).c_str(), function)
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->Repetitions(once ? 1 : repetitions);
    ++registered;
  };
  measure_as("own", [c](benchmark::State& s) { own(s, c); });
  if (all_modes && c.level > 0) {
    measure_as("cloud", [c](benchmark::State& s) { cloud(s, c); });
    measure_as("stock_pixels", [c](benchmark::State& s) { stock(s, c, StockMode::kBoth, true); });
  }
  for (const StockMode mode : kModes) {
    if (!all_modes && mode != StockMode::kPlain && mode != StockMode::kBoth) continue;
    measure_as(std::string("stock_") + to_string(mode),
               [c, mode](benchmark::State& s) { stock(s, c, mode, c.level == 0); });
  }
  return registered;
}

/// Keeps the best time of each benchmark (the least disturbed one) and prints it once.
class BestReporter final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    std::string name;
    double best_ms = kInfinity;
    double allocations = 0.0;
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      name = run.run_name.function_name;
      best_ms = std::min(best_ms, run.GetAdjustedRealTime());
      allocations = run.counters.at("allocations").value;
    }
    if (name.empty()) return;
    best_ms_[name] = best_ms;
    allocations_[name] = allocations;
    const auto units = runs.front().counters.find("units");
    std::printf("%-48s %10.3f ms %12.0f allocations", name.c_str(), best_ms, allocations);
    if (units != runs.front().counters.end()) std::printf(" %10.0f units of work", units->second.value);
    std::printf("\n");
    std::fflush(stdout);
  }
  [[nodiscard]] double ms(const std::string& name) const {
    const auto found = best_ms_.find(name);
    return found == best_ms_.end() ? std::nan("") : found->second;
  }
  [[nodiscard]] double best_stock_ms(const Case& c) const {
    double best = kInfinity;
    for (const StockMode mode : kModes)
      best = std::fmin(best, ms(name_of(std::string("stock_") + to_string(mode), c)));
    return best;
  }
  [[nodiscard]] double own_allocations() const {
    double most = 0.0;
    for (const auto& [name, count] : allocations_)
      if (name.rfind("own", 0) == 0) most = std::max(most, count);
    return most;
  }

 private:
  std::map<std::string, double> best_ms_, allocations_;
};

Agreement agreement(int range_m) {
  const Scan& scan = scan_of(0, 128, range_m);
  OwnMap& map = own_map(128, range_m);
  map.reset();
  map.integrate(scan, 0);
  octomap::OcTree tree(kPublishedCell_m);
  insert(tree, stock_scan(scan, 0.0), StockMode::kPlain);
  std::printf("own map at %d m: %.3f bytes a known cell\n", range_m, map.bytes_per_cell());
  const Agreement result = compare(tree, map.view(), pillar_world(), scan.p_WB(), 1.8 * range_m);
  std::printf(
      "agreement at %d m: occupied %.5f of %zu, free %.5f of %zu; false free: own %zu of %zu, stock %zu\n",
      range_m, result.occupied_ratio, result.stock_occupied, result.free_ratio, result.stock_free,
      result.own_false_free, result.own_free, result.stock_false_free);
  return result;
}

/// Own map at 0.3 m over growing range: the best of some scans, and what it then knows.
std::vector<CostOfSpace> costs_of_space() {
  std::vector<CostOfSpace> costs;
  for (const int range_m : {10, 15, 20, 30, 40}) {
    const Scan& scan = scan_of(0, 128, range_m);
    OwnMap& map = own_map(128, range_m);
    CostOfSpace cost{static_cast<double>(range_m), kInfinity, 0.0, 0.0};
    for (int n = 0; n < 7; ++n) {
      map.reset();
      const double begin_s = cpu_s();
      (void)map.integrate(scan, 0);
      cost.own_ms = std::fmin(cost.own_ms, 1e3 * (cpu_s() - begin_s));
    }
    cost.known_m3 = map.known_m3();
    const stages::MapView& view = map.view();
    std::uint64_t lookups = 0;
    const double reach_m = 1.8 * range_m;
    for (double z = -0.45; z < reach_m; z += kPublishedCell_m)
      for (double y = -reach_m; y < reach_m; y += kPublishedCell_m)
        for (double x = -reach_m; x < reach_m; x += kPublishedCell_m)
          cost.surface_cells +=
              view.at(Vector3(x, y, z), lookups) == stages::CellState::kOccupied ? 1.0 : 0.0;
    std::printf("own at %d m: %.3f ms, %.0f m3 known, %.0f surface cells\n", range_m, cost.own_ms,
                cost.known_m3, cost.surface_cells);
    costs.push_back(cost);
  }
  return costs;
}

}  // namespace
}  // namespace roborun::bench

int main(int argc, char** argv) {
  using namespace roborun::bench;
  std::string picture;
  if (argc > 2 && std::string(argv[1]) == "--svg") {
    picture = argv[2];
    argv[2] = argv[0];
    argc -= 2;
    argv += 2;
  }
  if (argc > 1 && std::string(argv[1]) == "--once") {
    once = true;
    argv[1] = argv[0];
    --argc;
    ++argv;
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  std::size_t registered = 0;
  for (const int range_m : {20, 40})
    for (int level = 0; level < roborun::kPrecisionLevels; ++level)
      registered += add({level, range_m, 128, false}, true);
  for (int level = 0; level < roborun::kPrecisionLevels; ++level)
    registered += add({level, 20, 128, true}, false);
  registered += add({0, 40, 128, true}, false);
  for (const int pixels : {64, 256}) registered += add({0, 20, pixels, false}, false);
  BestReporter reporter;
  const std::size_t run = benchmark::RunSpecifiedBenchmarks(&reporter);
  if (run < registered) return 0;  // a selection has no summary

  const Agreement near = agreement(20), far = agreement(40);
  const double bytes_per_cell =
      std::fmax(own_map(128, 20).bytes_per_cell(), own_map(128, 40).bytes_per_cell());
  double worst = kInfinity, worst_from_images = kInfinity;
  for (const int range_m : {20, 40})
    for (int level = 0; level < roborun::kPrecisionLevels; ++level) {
      const Case c{level, range_m, 128, false};
      const double own_ms = reporter.ms(name_of("own", c)), stock_ms = reporter.best_stock_ms(c);
      worst = std::fmin(worst, stock_ms / own_ms);
      const double from_images_ms = level == 0 ? stock_ms
                                               : std::fmin(reporter.ms(name_of("cloud", c)) + stock_ms,
                                                           reporter.ms(name_of("stock_pixels", c)));
      worst_from_images = std::fmin(worst_from_images, from_images_ms / own_ms);
    }
  if (!picture.empty()) {
    std::vector<CostAtPrecision> precision;
    for (const int range_m : {20, 40}) {
      for (int level = 0; level < roborun::kPrecisionLevels; ++level) {
        const Case c{level, range_m, 128, false};
        precision.push_back({range_m, roborun::PrecisionLattice{}.cell_size_m(level), reporter.ms(name_of("own", c)),
                             reporter.best_stock_ms(c)});
      }
    }
    std::ofstream file(picture);
    file << map_cost_svg(precision, costs_of_space());
    file.close();
    if (!file) {
      std::fprintf(stderr, "%s: cannot be written\n", picture.c_str());
      return 2;
    }
  }
  const auto own_ms = [&](int level, int range_m) {
    return reporter.ms(name_of("own", {level, range_m, 128, false}));
  };
  const auto plain = [&](int range_m) {
    return reporter.ms(name_of("stock_plain", {0, range_m, 128, false})) / own_ms(0, range_m);
  };
  const auto best = [&](int range_m) {
    return reporter.best_stock_ms({0, range_m, 128, false}) / own_ms(0, range_m);
  };
  std::printf(
      "{\"speedup_plain_20m\":%.1f,\"speedup_plain_40m\":%.1f,\"speedup_best_20m\":%.1f,\"speedup_best_40m\":"
      "%.1f,"
      "\"coarse_cost_ratio\":%.3f,\"worst_speedup_best_any_p0\":%.2f,"
      "\"worst_speedup_from_images_any_p0\":%.2f,\"allocations\":%.0f,\"bytes_per_cell\":%.2f,"
      "\"occupied_agreement\":%.5f,\"free_agreement\":%.5f,\"false_free_vs_stock\":%.4f}\n",
      plain(20), plain(40), best(20), best(40),
      std::fmax(own_ms(4, 20) / own_ms(0, 20), own_ms(4, 40) / own_ms(0, 40)), worst, worst_from_images,
      reporter.own_allocations(), bytes_per_cell, std::fmin(near.occupied_ratio, far.occupied_ratio),
      std::fmin(near.free_ratio, far.free_ratio),
      static_cast<double>(near.own_false_free + far.own_false_free) /
          static_cast<double>(std::max<std::size_t>(near.stock_false_free + far.stock_false_free, 1)));
  return 0;
}
