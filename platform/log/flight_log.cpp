#include "platform/log/flight_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "platform/input/base64.hpp"
#include "platform/log/json_text.hpp"
#include "platform/log/log_schemas.hpp"
#include "platform/log/why.hpp"

namespace roborun::log {
namespace {

constexpr const char* kWorldFrame = "world";
constexpr const char* kBodyFrame = "body";
/// With the tenth of a second that a message of inputs waits for, a cut loses less than a second. On real time the log's thread and
/// the disk need some of that second.
constexpr std::uint64_t kChunk_ns = 800'000'000;
constexpr std::uint64_t kSyncedChunk_ns = 500'000'000;
constexpr std::uint64_t kStatesPerPose = 4;    // 40 Hz to 10 Hz
constexpr std::uint64_t kStatesPerPoint = 20;  // two points a second ...
constexpr std::uint64_t kStatesPerPath = 80;
constexpr std::size_t kMostFlown = 128;  // ... until there are so many: then every second one goes

/// A record for which there is no memory is dropped and counted: a flight goes on.
template <typename F>
void guarded(std::uint64_t& dropped, F&& write) noexcept {
  try {
    write();
  } catch (...) {
    ++dropped;
  }
}

double seconds_of(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

std::string quaternion_json(const std::array<double, 4>& q_WB) {
  return std::string(JsonText()
                         .number("x", q_WB[1], 5)
                         .number("y", q_WB[2], 5)
                         .number("z", q_WB[3], 5)
                         .number("w", q_WB[0], 5)
                         .done());
}

std::string pose_json(const Numbers3& p_W, const std::array<double, 4>& q_W) {
  JsonText pose;
  return std::string(pose.vector("position", p_W).json("orientation", quaternion_json(q_W)).done());
}

template <typename Points>
std::string poses_json(std::int64_t time_ns, const Points& points, std::size_t count) {
  std::string poses;
  for (std::size_t i = 0; i < count; ++i) poses += (i == 0 ? "" : ",") + pose_json(points[i], {1, 0, 0, 0});
  JsonText message;
  return std::string(
      message.stamp(time_ns).text("frame_id", kWorldFrame).json("poses", "[" + poses + "]").done());
}

std::string list_of(const std::vector<std::string>& lines) {
  fmt::memory_buffer list;
  list.push_back('[');
  for (const std::string& line : lines) {
    if (list.size() > 1) list.push_back(',');
    append_json_string(list, line);
  }
  list.push_back(']');
  return {list.data(), list.size()};
}

std::string state_json(const StateRecord& r) {
  constexpr int kDigits = 3;  // millimetres, milliradians
  JsonText j;
  const auto put3 = [&j](const std::array<std::string_view, 3>& keys, const Numbers3& values) {
    for (std::size_t i = 0; i < 3; ++i) j.number(keys[i], values[i], kDigits);
  };
  const auto length = [](const Numbers3& v) { return std::hypot(v[0], v[1], v[2]); };
  const Numbers3& p = r.p_WB;
  const Numbers3& ref = r.reference_p_W;
  j.number("time_s", seconds_of(r.time_ns));
  put3({"x_m", "y_m", "z_m"}, p);
  put3({"vx_mps", "vy_mps", "vz_mps"}, r.v_WB);
  j.number("speed_mps", length(r.v_WB), kDigits);
  j.number("qw", r.q_WB[0]).number("qx", r.q_WB[1]).number("qy", r.q_WB[2]).number("qz", r.q_WB[3]);
  j.number("yaw_rad", r.yaw_rad, kDigits);
  put3({"wx_radps", "wy_radps", "wz_radps"}, r.w_WB_B);
  put3({"ref_x_m", "ref_y_m", "ref_z_m"}, ref);
  put3({"ref_vx_mps", "ref_vy_mps", "ref_vz_mps"}, r.reference_v_W);
  put3({"ref_ax_mps2", "ref_ay_mps2", "ref_az_mps2"}, r.reference_a_W);
  j.number("error_m", length({p[0] - ref[0], p[1] - ref[1], p[2] - ref[2]}), kDigits);
  j.number("position_sigma_m", r.position_sigma_m, kDigits);
  if (r.has_motors)
    for (std::size_t i = 0; i < r.motors.size(); ++i)
      j.number(fmt::format("motor_{}", i + 1), r.motors[i], kDigits);
  j.number("battery_ratio", r.battery_ratio).text("phase", r.phase).text("action", r.action);
  if (r.has_truth) put3({"true_x_m", "true_y_m", "true_z_m"}, r.true_p_W);
  return std::string(j.done());
}

}  // namespace

std::string decision_json(const DecisionEntry& e) {
  JsonText j;
  j.number("number", static_cast<double>(e.number), 0)
      .number("time_s", seconds_of(e.time_ns))
      .text("kind", e.kind);
  j.number("x_m", e.p_WB[0]).number("y_m", e.p_WB[1]).number("z_m", e.p_WB[2]);
  j.number("goal_x_m", e.goal_W[0]).number("goal_y_m", e.goal_W[1]).number("goal_z_m", e.goal_W[2]);
  j.number("speed_mps", e.speed_mps).number("speed_limit_mps", e.speed_limit_mps);
  j.text("speed_source", e.speed_source);
  j.number("p0_m", e.p0_m).number("p1_m", e.p1_m);
  j.number("v0_m3", e.v0_m3, 1).number("v1_m3", e.v1_m3, 1).number("v2_m3", e.v2_m3, 1);
  j.number("time_budget_s", e.time_budget_s).text("budget_source", e.budget_source);
  j.number("deadline_s", e.deadline_s).number("latency_s", e.latency_s, 6);
  for (std::size_t i = 0; i < core::kStageCount; ++i) {
    const char* stage = core::to_string(static_cast<core::StageId>(i));
    j.number(fmt::format("{}_s", stage), e.stage_s[i], 6);
    j.number(fmt::format("{}_predicted_s", stage), e.predicted_s[i], 6);
  }
  j.number("visible_m", e.visible_m, 2).number("closest_obstacle_m", e.closest_obstacle_m, 2);
  j.number("gap_average_m", e.gap_average_m, 2).number("sensor_volume_m3", e.sensor_volume_m3, 0);
  j.number("map_volume_m3", e.map_volume_m3, 0).number("demand_m", e.demand_m, 3);
  j.text("solver", e.solver).text("active", e.active.view()).text("ways", e.ways).number("way_m", e.way_m, 1);
  j.text("planner", e.planner).text("smoother", e.smoother).text("refused", e.refused.view());
  std::vector<std::string> why = why_of(e);
  for (std::string& line : outcome_of(e)) why.push_back(std::move(line));
  j.json("missed", e.missed ? "true" : "false").json("why", list_of(why));
  return std::string(j.done());
}

FlightLog::FlightLog(const std::string& path, bool synced)
    : file_(path, synced), writer_(file_, "", "roborun", {.chunk_ns = synced ? kSyncedChunk_ns : kChunk_ns}) {
  const auto channel = [this](const char* topic, const char* schema, const std::string& text) {
    return writer_.add_channel(writer_.add_schema(schema, "jsonschema", text), topic, "json");
  };
  configuration_ = channel("/configuration", "roborun.Configuration", object_schema("roborun.Configuration"));
  world_ = channel("/world", "roborun.World", object_schema("roborun.World"));
  state_ = channel("/state", "roborun.State", state_schema());
  pose_ = channel("/pose", "foxglove.PoseInFrame", pose_schema());
  tf_ = channel("/tf", "foxglove.FrameTransforms", transforms_schema());
  path_ = channel("/path", "foxglove.PosesInFrame", poses_schema());
  trajectory_ = channel("/trajectory", "foxglove.PosesInFrame", poses_schema());
  decision_ = channel("/decision", "roborun.Decision", decision_schema());
  map_ = channel("/map", "foxglove.Grid", grid_schema());
  failsafe_ = channel("/failsafe", "roborun.Failsafe", failsafe_schema());
  events_ = channel("/events", "foxglove.Log", text_schema());
  dropped_ = channel("/log/dropped", "roborun.Dropped", dropped_schema());
  result_ = channel("/result", "roborun.Result", object_schema("roborun.Result"));
  verdict_ = channel("/verdict", "roborun.Verdict", object_schema("roborun.Verdict"));
  inputs_ = writer_.add_channel(0, kInputsTopic, kInputsEncoding);
  path_step_ = kStatesPerPoint;
}

void FlightLog::show_to(LogViewer& viewer) {
  for (const Channel& channel : writer_.channels())
    if (channel.schema_id != 0) viewer.add(channel, writer_.schemas()[channel.schema_id - 1U]);
  viewer_ = &viewer;
}

void FlightLog::configure(const std::string& json, const StringMap& build) {
  writer_.add_metadata({"build", build});
  writer_.add_metadata({"configuration", {{"json", json}}});
  put(configuration_, 0, json);
}

void FlightLog::put(std::uint16_t channel, std::int64_t time_ns, std::string_view data) {
  last_ns_ = std::max(last_ns_, time_ns);
  writer_.message(channel, static_cast<std::uint64_t>(std::max<std::int64_t>(time_ns, 0)), data);
  if (viewer_ != nullptr && channel != inputs_) viewer_->show(channel, time_ns, data);
  if (writer_.dropped() != told_messages_) tell_drops();
}

void FlightLog::tell_drops() {
  told_messages_ = writer_.dropped();
  told_drops_ = drops_;
  JsonText j;
  j.number("messages", static_cast<double>(told_messages_), 0)
      .number("states", static_cast<double>(drops_.states), 0);
  j.number("decisions", static_cast<double>(drops_.decisions), 0);
  j.number("slices", static_cast<double>(drops_.slices), 0);
  writer_.message(dropped_, static_cast<std::uint64_t>(last_ns_), j.done());
}

void FlightLog::dropped(const RingDrops& drops) noexcept {
  drops_ = drops;
  if (drops_ != told_drops_) guarded(drops_.states, [&] { tell_drops(); });
}

void FlightLog::write_pose(const StateRecord& r) {
  JsonText pose;
  pose.stamp(r.time_ns).text("frame_id", kWorldFrame).json("pose", pose_json(r.p_WB, r.q_WB));
  put(pose_, r.time_ns, pose.done());
  JsonText transform;
  transform.stamp(r.time_ns).text("parent_frame_id", kWorldFrame).text("child_frame_id", kBodyFrame);
  transform.vector("translation", r.p_WB).json("rotation", quaternion_json(r.q_WB));
  put(tf_, r.time_ns, JsonText().json("transforms", fmt::format("[{}]", transform.done())).done());
}

void FlightLog::write_path(const StateRecord& r) {
  if (states_ % path_step_ == 0) flown_W_.push_back(r.p_WB);
  if (flown_W_.size() > kMostFlown) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < flown_W_.size(); i += 2) flown_W_[kept++] = flown_W_[i];
    flown_W_.resize(kept);
    path_step_ *= 2;
  }
  if (states_ % kStatesPerPath == 0) put(path_, r.time_ns, poses_json(r.time_ns, flown_W_, flown_W_.size()));
}

void FlightLog::write(const StateRecord& record) noexcept {
  guarded(drops_.states, [&] {
    put(state_, record.time_ns, state_json(record));
    if (states_ % kStatesPerPose == 0) write_pose(record);
    write_path(record);
    ++states_;
  });
}

void FlightLog::write(const FailsafeEntry& entry) noexcept {
  guarded(drops_.states, [&] {
    std::vector<std::string> conditions;
    for (std::string_view rest = entry.conditions.view(); !rest.empty();) {
      const std::size_t end = std::min(rest.find('+'), rest.size());
      conditions.emplace_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    JsonText j;
    j.number("time_s", seconds_of(entry.time_ns)).text("action", entry.action).text("phase", entry.phase);
    j.json("conditions", list_of(conditions)).text("sensor", entry.sensor.view());
    put(failsafe_, entry.time_ns, j.done());
    const std::string_view sensor = entry.sensor.view();
    event(entry.time_ns, Level::kWarning, "failsafe",
          fmt::format("{} ({}{}{})", entry.action, entry.conditions.view(), sensor.empty() ? "" : "; ",
                      sensor));
  });
}

void FlightLog::write(const DecisionEntry& entry) noexcept {
  guarded(drops_.decisions, [&] {
    put(decision_, entry.time_ns, decision_json(entry));
    if (entry.points > 0)
      put(trajectory_, entry.time_ns, poses_json(entry.time_ns, entry.point_W, entry.points));
  });
}

void FlightLog::write(const MapSlice& s) noexcept {
  guarded(drops_.slices, [&] {
    JsonText field;
    field.text("name", "occupancy").number("offset", 0, 0).number("type", 1, 0);  // UINT8
    JsonText cell;
    cell.number("x", s.cell_m).number("y", s.cell_m);
    JsonText j;
    j.stamp(s.time_ns).text("frame_id", kWorldFrame);
    j.json("pose", pose_json({s.x_m, s.y_m, s.z_m}, {1, 0, 0, 0})).number("column_count", s.columns, 0);
    j.json("cell_size", cell.done()).number("row_stride", s.columns, 0).number("cell_stride", 1, 0);
    j.json("fields", fmt::format("[{}]", field.done()));
    const auto count = static_cast<std::size_t>(s.columns) * s.rows;
    j.text("data", input::to_base64({reinterpret_cast<const char*>(s.cell.data()), count}));
    put(map_, s.time_ns, j.done());
  });
}

void FlightLog::world(std::string_view json) noexcept {
  guarded(drops_.states, [&] { put(world_, 0, json); });
}

void FlightLog::inputs(std::int64_t time_ns, std::string_view bytes) noexcept {
  guarded(drops_.states, [&] { put(inputs_, time_ns, bytes); });
}

void FlightLog::event(std::int64_t time_ns, Level level, std::string_view name,
                      std::string_view text) noexcept {
  guarded(drops_.states, [&] {
    JsonText j;
    j.stamp(time_ns).number("level", static_cast<double>(level), 0).text("message", text).text("name", name);
    put(events_, time_ns, j.text("file", "").number("line", 0, 0).done());
  });
}

void FlightLog::result(std::int64_t time_ns, std::string_view json) noexcept {
  guarded(drops_.states, [&] { put(result_, time_ns, json); });
}

void FlightLog::verdict(std::int64_t time_ns, std::string_view json) noexcept {
  guarded(drops_.states, [&] { put(verdict_, time_ns, json); });
}

FlightLog::~FlightLog() { finish(); }

void FlightLog::finish() noexcept {
  if (finished_) return;
  finished_ = true;
  guarded(drops_.states, [&] {
    writer_.close_chunk();
    if (writer_.dropped() != told_messages_ || drops_ != told_drops_) tell_drops();
    writer_.finish();
  });
}

std::string FlightLog::error() const {
  const std::string why = file_.error();
  return why.empty() ? why : fmt::format("{}; {} messages are missing in it", why, writer_.dropped());
}

}  // namespace roborun::log
