#include "platform/app/port_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "platform/app/exit_code.hpp"
#include "platform/app/options.hpp"
#include "platform/app/port_bridge_command.hpp"
#include "platform/input/input_error.hpp"
#include "platform/input/stop_signal.hpp"
#include "platform/rt/monotonic_clock.hpp"
#include "platform/sensor_port/port_devices.hpp"
#include "platform/sensor_port/port_names.hpp"
#include "platform/sensor_port/port_navigation.hpp"

namespace roborun::app {
namespace {

namespace sp = sensor_port;
using Json = nlohmann::ordered_json;

using sp::is_written_to, sp::kPortFolder, sp::kPortPrefix, sp::port_path;

/// A port, read as the runtime reads it, and what was in its newest sample.
class PortProbe {
 public:
  virtual ~PortProbe() = default;
  [[nodiscard]] virtual Status read(std::string& what, MonotonicTime& stamp) = 0;
  [[nodiscard]] virtual const sp::PortReader& reader() const = 0;
  [[nodiscard]] virtual const sp::PortRefusals& refusals() const = 0;
};

std::string words_of(const firmware_if::DepthFrame& f) {
  std::size_t known = 0, far = 0;
  float nearest_m = std::numeric_limits<float>::infinity();
  for (const float d : f.depth_m) {
    known += d > f.range_min_m ? 1 : 0;
    far += d > f.range_m ? 1 : 0;
    if (d > f.range_min_m) nearest_m = std::min(nearest_m, d);
  }
  const auto share = [&f](std::size_t n) {
    return 100.0 * static_cast<double>(n) / static_cast<double>(f.depth_m.size());
  };
  return fmt::format(
      "{} x {}, {:.0f} x {:.0f} degrees, {:.0f} % of the pixels know something, {:.0f} % see nothing within "
      "{:.1f} m, nearest {:.2f} m",
      f.width, f.height, 2.0 * 57.29578 * std::atan(static_cast<double>(f.tan_half_width)),
      2.0 * 57.29578 * std::atan(static_cast<double>(f.tan_half_height)), share(known), share(far),
      static_cast<double>(f.range_m), static_cast<double>(nearest_m));
}
std::string words_of(const firmware_if::LidarSweep& s) {
  return fmt::format("{} points within {:.1f} m", s.points_L_m.size(), static_cast<double>(s.range_m));
}
std::string words_of(const firmware_if::ImuSample& s) {
  return fmt::format("rates ({:.2f}, {:.2f}, {:.2f}) rad/s, force ({:.2f}, {:.2f}, {:.2f}) m/s2",
                     s.angular_rate_B_radps[0], s.angular_rate_B_radps[1], s.angular_rate_B_radps[2],
                     s.specific_force_B_mps2[0], s.specific_force_B_mps2[1], s.specific_force_B_mps2[2]);
}
std::string words_of(const firmware_if::OdometrySample& s) {
  return fmt::format("at ({:.2f}, {:.2f}, {:.2f}) m within {:.2f} m, reset {}", s.p_OB_m[0], s.p_OB_m[1],
                     s.p_OB_m[2], s.sigma_position_m, s.reset_counter);
}

std::string words_of(const firmware_if::GnssFix& f) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) m from the first fix, within {:.2f} m, {}", f.p_WB_m[0],
                     f.p_WB_m[1], f.p_WB_m[2], f.sigma_horizontal_m,
                     std::isfinite(f.heading_rad) ? "with a heading" : "no heading");
}
std::string words_of(const firmware_if::BarometerSample& s) {
  return fmt::format("{:+.2f} m since the first sample", s.altitude_m);
}

template <typename Device, typename Sample>
class DeviceProbe final : public PortProbe {
 public:
  std::string open(const std::string& path) { return device_.open(path, {}); }
  [[nodiscard]] Status read(std::string& what, MonotonicTime& stamp) override {
    Sample sample;
    const Status status = device_.read(sample);
    if (status != Status::kOk) return status;
    what = words_of(sample);
    stamp = sample.stamp;
    return status;
  }
  [[nodiscard]] const sp::PortReader& reader() const override { return device_.reader(); }
  [[nodiscard]] const sp::PortRefusals& refusals() const override { return device_.refusals(); }

 private:
  Device device_;
};

/// Kinds that say nothing on their own: the port's rules alone.
class PlainProbe final : public PortProbe {
 public:
  std::string open(const std::string& path) { return reader_.open(path, 0); }
  [[nodiscard]] Status read(std::string& what, MonotonicTime& stamp) override {
    sp::PortSample port;
    const Status status = reader_.next(port);
    if (status != Status::kOk) return status;
    roborun_port_stamp at;
    std::memcpy(&at, port.sample.data(), sizeof at);
    stamp = MonotonicTime{Nanos{at.stamp_ns + port.clock_offset_ns}};
    what = fmt::format("number {}", at.sequence);
    return status;
  }
  [[nodiscard]] const sp::PortReader& reader() const override { return reader_; }
  [[nodiscard]] const sp::PortRefusals& refusals() const override { return none_; }

 private:
  sp::PortReader reader_;
  sp::PortRefusals none_{};
};

template <typename P>
std::unique_ptr<PortProbe> open_probe(const std::string& path) {
  auto probe = std::make_unique<P>();
  if (const std::string wrong = probe->open(path); !wrong.empty())
    throw InputError(fmt::format("{}: {}", path, wrong));
  return probe;
}

std::unique_ptr<PortProbe> open_port(const std::string& name) {
  const std::string path = port_path(name);
  std::unique_ptr<PortProbe> plain = open_probe<PlainProbe>(path);
  switch (plain->reader().kind()) {
    case ROBORUN_PORT_DEPTH:
      return open_probe<DeviceProbe<sp::PortDepthCamera, firmware_if::DepthFrame>>(path);
    case ROBORUN_PORT_CLOUD:
      return open_probe<DeviceProbe<sp::PortLidar, firmware_if::LidarSweep>>(path);
    case ROBORUN_PORT_IMU:
      return open_probe<DeviceProbe<sp::PortImu, firmware_if::ImuSample>>(path);
    case ROBORUN_PORT_ODOMETRY:
      return open_probe<DeviceProbe<sp::PortOdometry, firmware_if::OdometrySample>>(path);
    case ROBORUN_PORT_GNSS:
      return open_probe<DeviceProbe<sp::PortGnss, firmware_if::GnssFix>>(path);
    case ROBORUN_PORT_PRESSURE:
      return open_probe<DeviceProbe<sp::PortBarometer, firmware_if::BarometerSample>>(path);
    default:
      return plain;
  }
}

/// What was seen of a port while it was watched.
struct PortSeen {
  double seconds{};
  std::uint64_t samples{};
  std::string newest;
  double age_s{std::numeric_limits<double>::quiet_NaN()};  ///< Of the newest sample when it was read.
  bool cut{false};
};

PortSeen watch_for(PortProbe& probe, double duration_s) {
  PortSeen seen;
  const MonotonicTime start = rt::monotonic_now();
  const MonotonicTime end = start + from_seconds(duration_s);
  while (rt::monotonic_now() < end && !input::StopOnSignal::requested()) {
    MonotonicTime stamp{};
    const Status status = probe.read(seen.newest, stamp);
    if (status == Status::kOk) {
      ++seen.samples;
      seen.age_s = seconds(rt::monotonic_now() - stamp);
      continue;
    }
    seen.cut = status == Status::kIo;
    if (seen.cut) break;
    std::this_thread::sleep_for(std::chrono::microseconds{200});
  }
  seen.seconds = seconds(rt::monotonic_now() - start);
  return seen;
}

/// Why the runtime could not fly with it; empty: it could.
std::string why_not_ready(const std::string& path, const PortProbe& probe, const PortSeen& seen) {
  const sp::PortRefusals& r = probe.refusals();
  const std::uint64_t refused = r.size + r.optics + r.values;
  if (seen.cut) return "the file was cut short: its feeder has to start again";
  if (!is_written_to(path)) return "no process writes to it: start its feeder";
  if (seen.samples == 0 && refused > 0)
    return fmt::format(
        "all of its {} samples were refused ({} for their size, {} for optics, range or mount, {} for their "
        "values)",
        refused, r.size, r.optics, r.values);
  if (seen.samples == 0) return fmt::format("its writer wrote nothing for {:.1f} s", seen.seconds);
  if (!(seen.age_s < 0.5))
    return fmt::format("its newest sample is {:.2f} s old: must be below 0.5 s", seen.age_s);
  if (seen.age_s < -0.01)
    return fmt::format("its stamps are {:.2f} s ahead of this machine's clock", -seen.age_s);
  return {};
}

Json port_json(const std::string& name, const std::string& path, const PortProbe& probe,
               const PortSeen& seen) {
  const sp::PortCounters& c = probe.reader().counters();
  const sp::PortRefusals& r = probe.refusals();
  const std::string complaint = why_not_ready(path, probe, seen);
  Json json{{"port", name},
            {"device", sp::kind_name(probe.reader().kind())},
            {"ready", complaint.empty()},
            {"reason", complaint}};
  json["rate_Hz"] = seen.seconds > 0.0 ? static_cast<double>(seen.samples) / seen.seconds : 0.0;
  json["age_s"] = std::isfinite(seen.age_s) ? Json(seen.age_s) : Json(nullptr);
  json["frames"] = seen.samples;
  json["dropped"] = c.dropped;
  json["torn"] = c.torn;
  json["refused"] = {{"rules", c.refused},
                     {"size", r.size},
                     {"optics", r.optics},
                     {"values", r.values},
                     {"backwards", r.backwards}};
  json["restarts"] = c.restarts;
  json["newest"] = seen.newest;
  return json;
}

std::string port_line(const PortSeen& seen) {
  if (seen.samples == 0) return "no samples";
  return fmt::format("{:.1f} Hz, {:.1f} ms old; {}", static_cast<double>(seen.samples) / seen.seconds,
                     1e3 * seen.age_s, seen.newest);
}

int list_ports(bool json) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kPortFolder)) {
    const std::string file = entry.path().filename();
    if (file.rfind(kPortPrefix, 0) == 0 && !file.ends_with(".part"))
      names.push_back(file.substr(std::string(kPortPrefix).size()));
  }
  std::sort(names.begin(), names.end());
  if (names.empty() && !json) fmt::print("no ports: {}/{}* are made by feeders\n", kPortFolder, kPortPrefix);
  for (const std::string& name : names) {
    const std::string path = port_path(name);
    sp::PortReader reader;
    const std::string wrong = reader.open(path, 0);
    const bool alive = is_written_to(path);
    if (json) {
      const Json device = wrong.empty() ? Json(sp::kind_name(reader.kind())) : Json(nullptr);
      fmt::print("{}\n",
                 Json{{"port", name}, {"device", device}, {"written_to", alive}, {"reason", wrong}}.dump());
    } else if (wrong.empty()) {
      fmt::print("{:<20} {:<9} {:4} slots  {}\n", name, sp::kind_name(reader.kind()), reader.slot_count(),
                 alive ? "written to" : "no writer");
    } else {
      fmt::print("{:<20} {}\n", name, wrong);
    }
  }
  return kDone;
}

int watch_port(const std::string& name, double duration_s, bool json) {
  const std::unique_ptr<PortProbe> probe = open_port(name);
  const input::StopOnSignal stop;
  for (double left_s = duration_s; left_s > 0.0 && !input::StopOnSignal::requested(); left_s -= 1.0) {
    const PortSeen seen = watch_for(*probe, std::min(left_s, 1.0));
    const sp::PortCounters& c = probe->reader().counters();
    if (json)
      fmt::print("{}\n", port_json(name, port_path(name), *probe, seen).dump());
    else
      fmt::print("{}: {}; {} missed, {} torn, {} refused\n", name, port_line(seen), c.dropped, c.torn,
                 c.refused + probe->refusals().size + probe->refusals().optics + probe->refusals().values);
    (void)std::fflush(stdout);
    if (seen.cut)
      throw InputError(
          fmt::format("{}: the file was cut short: its feeder has to start again", port_path(name)));
  }
  return input::StopOnSignal::requested() ? kInterrupted : kDone;
}

int check_ports(const std::vector<std::string>& names, double duration_s, bool json) {
  bool ready = true;
  for (const std::string& name : names) {
    const std::unique_ptr<PortProbe> probe = open_port(name);
    const PortSeen seen = watch_for(*probe, duration_s);
    const std::string complaint = why_not_ready(port_path(name), *probe, seen);
    ready = ready && complaint.empty();
    if (json)
      fmt::print("{}\n", port_json(name, port_path(name), *probe, seen).dump());
    else
      fmt::print("{:<9} {}: {}\n", complaint.empty() ? "READY" : "NOT READY", name,
                 complaint.empty() ? port_line(seen) : complaint);
  }
  return ready ? kDone : kNotGood;
}

}  // namespace

void add_port_command(CLI::App& app, std::function<int()>& run) {
  struct PortOptions {
    std::string name;
    std::vector<std::string> names;
    double watch_s{1e9}, check_s{1.0};
    bool json{false};
  };
  const auto options = std::make_shared<PortOptions>();
  CLI::App* port_app =
      app.add_subcommand("port", "Sensor ports, into which other processes write what sensors measure");
  port_app->require_subcommand(1);
  port_app->footer(
      "A port is a file /dev/shm/roborun-NAME (platform/sensor_port/roborun_port.h). Example, in two "
      "terminals:\n"
      "  platform/sensor_port/example/feed_wall.py front\n"
      "  roborun port check front");
  CLI::App* list_app =
      port_app->add_subcommand("list", "All ports of this machine, and whether a process writes to them");
  list_app->add_flag("--json", options->json, "One object per port: port, device, written_to, reason");
  list_app->callback([options, &run] { run = [options] { return list_ports(options->json); }; });

  CLI::App* watch_app =
      port_app->add_subcommand("watch", "Rate, age and content of one port, once per second");
  watch_app->add_option("port", options->name, "NAME, or a file")->required();
  add_number(*watch_app, "--seconds", options->watch_s, 0.1, 1e9,
             "Stop after this many seconds; default: at Ctrl-C (exit code 130)")
      ->default_str("");
  watch_app->add_flag("--json", options->json, "One object per second, with the counters since the start");
  watch_app->callback([options, &run] {
    run = [options] { return watch_port(options->name, options->watch_s, options->json); };
  });

  CLI::App* check_app = port_app->add_subcommand(
      "check", "Could a flight use these ports? Exit code 1: not all of them, and it says why");
  check_app->add_option("port", options->names, "NAME, or a file; several")->required();
  add_number(*check_app, "--seconds", options->check_s, 0.1, 60.0, "How long each is watched, 0.1 .. 60");
  check_app->add_flag("--json", options->json, "One object per port");
  check_app->callback([options, &run] {
    run = [options] { return check_ports(options->names, options->check_s, options->json); };
  });

  add_port_bridge_commands(*port_app, run);
}

}  // namespace roborun::app
