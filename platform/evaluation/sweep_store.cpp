#include "platform/evaluation/sweep_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <optional>
#include <thread>

#include "platform/input/input_error.hpp"
#include "platform/input/text_file.hpp"
#include "platform/report/result_line.hpp"

namespace roborun::evaluation {
namespace {

constexpr const char* kRequest = "request.json";
constexpr const char* kResults = "results.jsonl";

std::string flight_name(const SweepMission& m) { return fmt::format("flight_{}_{}.json", m.design, m.seed); }

/// Nothing if there is no such file.
std::optional<std::string> read_file(const std::string& path) {
  constexpr std::size_t kMost_bytes = 1U << 30U;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nullopt;
  return input::read_text(path, "a readable file of roborun sweep", kMost_bytes);
}

/// What was flown with which sources, if that is what two plans differ in.
std::string both_commits(const SweepPlan& held, const SweepPlan& wanted, const std::string& key) {
  if (key != "commit") return {};
  return fmt::format(" ({}; this program is of {})", held.commit.empty() ? "unknown" : held.commit,
                     wanted.commit);
}

[[noreturn]] void cannot(const std::string& path) {
  throw InputError(fmt::format("{}: cannot be written: {}", path, strerror(errno)));
}

/// The children of a sweep that was killed hold its lock until they are dead, too: moments.
bool lock_soon(int fd) {
  constexpr int kTries = 20;
  constexpr std::chrono::milliseconds kPause{50};
  for (int i = 0; i < kTries; ++i) {
    if (flock(fd, LOCK_EX | LOCK_NB) == 0) return true;
    std::this_thread::sleep_for(kPause);
  }
  return false;
}

/// What a process that was killed had begun: the folder is ours alone now.
void remove_parts(const std::string& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file() && entry.path().extension() == ".part") std::filesystem::remove(entry.path());
  }
}

/// At the end of the results, and on the disk.
void append(int fd, const std::string& text, const std::string& path) {
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = write(fd, text.data() + at, text.size() - at);
    if (n < 0 && errno != EINTR) cannot(path);
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  if (fsync(fd) != 0) cannot(path);
}

}  // namespace

void check_folder(const std::string& folder, const std::vector<std::string>& inputs) {
  namespace fs = std::filesystem;
  std::error_code error;
  for (const std::string& in : inputs) {
    if (in.empty() || !fs::is_regular_file(in, error)) continue;
    if (fs::equivalent(fs::canonical(in, error).parent_path(), folder, error))
      throw InputError(
          fmt::format("--out: {}: {} is read, and lies in it: must be another folder", folder, in));
  }
}

SweepPlan plan_of_folder(const std::string& folder) {
  const std::string path = folder + "/" + kRequest;
  const auto text = read_file(path);
  if (!text) throw InputError(fmt::format("{}: cannot be opened: give a folder of roborun sweep", path));
  return plan_from_json(path, *text);
}

SweepStore::SweepStore(std::string folder, SweepPlan plan)
    : folder_(std::move(folder)), plan_(std::move(plan)), missions_(missions_of(plan_)) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw InputError(fmt::format("{}: cannot be made: {}", folder_, error.message()));
  lock_ = open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) cannot(folder_);
  if (!lock_soon(lock_)) {
    (void)close(lock_);
    throw InputError(fmt::format("{}: another process is sweeping into it: give another --out", folder_));
  }
  try {
    remove_parts(folder_);
    if (std::filesystem::exists(path(kRequest))) {
      const SweepPlan held = plan_of_folder(folder_);
      const std::string key = difference(held, plan_);
      if (!key.empty()) {
        throw InputError(fmt::format("{}: holds a sweep with other {}{}: give another --out, or remove it",
                                     folder_, key, both_commits(held, plan_, key)));
      }
    } else if (std::filesystem::exists(path(kResults))) {
      throw InputError(fmt::format("{}: holds results without a {}: give another --out", folder_, kRequest));
    } else {
      input::write_file(path(kRequest), to_json(plan_));
    }
    take_lines(read_file(path(kResults)).value_or(""));
    file_ = open(path(kResults).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    if (file_ < 0) cannot(path(kResults));
  } catch (...) {
    (void)close(lock_);
    throw;
  }
}

SweepStore::~SweepStore() {
  (void)close(file_);
  (void)close(lock_);
}

void SweepStore::take_lines(const std::string& text) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < missions_.size(); ++i) index[name_of(missions_[i])] = i;
  std::size_t at = 0;
  std::string kept;
  for (int number = 1; at < text.size(); ++number) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) break;  // cut off while it was written
    const std::string line = text.substr(at, end - at);
    at = end + 1;
    const auto result = report::from_line(line);
    const auto found = result ? index.find(name_of(mission_of_result(*result))) : index.end();
    if (found == index.end()) {
      throw InputError(
          fmt::format("{}:{}: is not a result of this sweep: remove the line", path(kResults), number));
    }
    const SweepMission& mission = missions_[found->second];
    if (is_representative(plan_, mission) && !std::filesystem::exists(path(flight_name(mission))))
      continue;  // somebody removed its flight: fly it again
    if (!lines_.emplace(found->second, line).second) continue;
    kept += line + '\n';
  }
  if (kept != text) input::write_file(path(kResults), kept);
}

void SweepStore::add(std::size_t mission, const std::string& line, const std::string& flight) {
  if (!flight.empty()) input::write_file(path(flight_name(missions_[mission])), flight);
  append(file_, line + '\n', path(kResults));
  lines_[mission] = line;
}

void SweepStore::sort() {
  std::string text;
  for (const auto& [index, line] : lines_) text += line + '\n';
  if (read_file(path(kResults)).value_or("") == text) return;
  input::write_file(path(kResults), text);
  (void)close(file_);
  file_ = open(path(kResults).c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file_ < 0) cannot(path(kResults));
}

std::vector<report::MissionResult> SweepStore::results() const {
  std::vector<report::MissionResult> results;
  for (const auto& [index, line] : lines_) results.push_back(*report::from_line(line));
  return results;
}

std::string SweepStore::flight(const SweepMission& mission) const {
  return read_file(path(flight_name(mission))).value_or("");
}

void merge_shards(const std::vector<std::string>& folders, const std::string& out) {
  SweepPlan whole = plan_of_folder(folders.front());
  whole.shard = whole.shards = 1;
  for (const std::string& folder : folders) {
    SweepPlan plan = plan_of_folder(folder);
    plan.shard = plan.shards = 1;
    const std::string key = difference(plan, whole);
    if (!key.empty())
      throw InputError(
          fmt::format("{}: has other {} than {}: must be shards of one sweep", folder, key, folders.front()));
  }
  SweepStore merged(out, whole);
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < merged.missions().size(); ++i) index[name_of(merged.missions()[i])] = i;
  std::map<std::size_t, std::string> seen;
  for (const std::string& folder : folders) {
    if (std::filesystem::equivalent(folder, out))
      throw InputError(fmt::format("{}: is a shard and --out at once: give another --out", folder));
    const SweepStore shard(folder, plan_of_folder(folder));
    for (const report::MissionResult& result : shard.results()) {
      const SweepMission mission = mission_of_result(result);
      const std::size_t i = index.at(name_of(mission));
      const std::string line = report::to_line(result);
      const auto [before, fresh] = seen.emplace(i, line);
      if (before->second != line)
        throw InputError(
            fmt::format("{}: two shards have different results for {}", folder, name_of(mission)));
      if (!fresh || merged.has(i)) continue;
      merged.add(i, line, is_representative(whole, mission) ? shard.flight(mission) : std::string{});
    }
  }
  merged.sort();
}

}  // namespace roborun::evaluation
