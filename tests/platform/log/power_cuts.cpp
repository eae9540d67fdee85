// usage: power_cuts LOG CALLS CUTS SEED
//
// Cuts the power at random moments of a flight whose log and write_recorder's calls are given. What a disk then may hold: what was
// synced; of the rest, each page of 4 KiB or zeros in its place; a size up to what was written, or beyond it with zeros. Asked of each:
// the log opens, has no message that the whole one lacks, and ends at most a second before the cut. Exit code 0: so it is.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/log/mcap_reader.hpp"
#include "tests/platform/log/write_recorder.hpp"

namespace {

using namespace roborun;
using What = test::RecordedCall::What;

constexpr std::int64_t kMostLost_ns = 1'000'000'000;
constexpr std::int64_t kPage_bytes = 4096;
/// The flight began at most so long before the log says so: a message of its newest chunk waits for the one that closes the chunk (25 ms
/// later), and for the log's thread (50 ms).
constexpr std::int64_t kOlder_ns = 75'000'000;

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<test::RecordedCall> calls_of(const std::string& path) {
  const std::string bytes = bytes_of(path);
  std::vector<test::RecordedCall> calls(bytes.size() / sizeof(test::RecordedCall));
  std::copy_n(bytes.data(), calls.size() * sizeof(test::RecordedCall), reinterpret_cast<char*>(calls.data()));
  return calls;
}

struct Entry {
  std::uint64_t log_ns;
  std::string data;
  bool operator==(const Entry&) const = default;
};

/// The messages of a file; none if it is no log.
std::vector<Entry> entries_of(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
  std::vector<Entry> entries;
  try {
    log::McapReader reader(path);
    for (log::Message m; reader.next(m);)
      entries.push_back({m.log_ns, m.channel->topic + std::string(m.data)});
  } catch (const InputError&) {
  }
  return entries;
}

std::int64_t last_ns(const std::vector<Entry>& entries) {
  std::uint64_t last = 0;
  for (const Entry& e : entries) last = std::max(last, e.log_ns);
  return static_cast<std::int64_t>(last);
}

/// When the flight began, CLOCK_MONOTONIC: not later than this.
std::int64_t start_of(const std::vector<test::RecordedCall>& calls, const std::string& log,
                      const std::string& scratch) {
  std::int64_t start_ns = std::numeric_limits<std::int64_t>::max();
  for (const test::RecordedCall& c : calls) {
    if (c.what != What::kWritten) continue;
    const auto entries = entries_of(scratch, log.substr(0, static_cast<std::size_t>(c.size_bytes)));
    if (last_ns(entries) > 0) start_ns = std::min(start_ns, c.begin_ns - last_ns(entries));
  }
  return start_ns - kOlder_ns;
}

/// What the disk may hold at a moment.
std::string left_at(std::int64_t cut_ns, const std::vector<test::RecordedCall>& calls, const std::string& log,
                    std::mt19937_64& random) {
  std::int64_t synced = 0;
  std::int64_t written = 0;
  bool named = false;
  for (std::size_t i = 0; i < calls.size(); ++i) {
    const test::RecordedCall& c = calls[i];
    if (c.what == What::kFolderSynced && c.end_ns <= cut_ns) named = true;
    if (c.what == What::kSynced && c.end_ns <= cut_ns) synced = c.size_bytes;
    if (c.what == What::kWritten && c.begin_ns <= cut_ns) written = c.size_bytes;
  }
  if (!named) return {};
  const auto below = [&random](std::int64_t count) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(count));
  };
  std::string left = log.substr(0, static_cast<std::size_t>(written));
  for (std::int64_t page = synced / kPage_bytes * kPage_bytes; page < written; page += kPage_bytes) {
    if (below(2) == 0) continue;
    const std::int64_t from = std::max(page, synced);
    std::fill(left.begin() + from, left.begin() + std::min(page + kPage_bytes, written), '\0');
  }
  switch (below(3)) {
    case 0:
      left.resize(static_cast<std::size_t>(synced + below(written - synced + 1)));
      break;
    case 1:
      left.resize(static_cast<std::size_t>(written + below(4 * kPage_bytes)), '\0');
      break;
    default:
      break;
  }
  return left;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::string log = bytes_of(argv[1]);
  const std::vector<test::RecordedCall> calls = calls_of(argv[2]);
  const int cuts = std::stoi(argv[3]);
  std::mt19937_64 random(std::stoull(argv[4]));
  const std::string scratch = std::string(argv[1]) + ".cut";
  const std::vector<Entry> whole = entries_of(scratch, log);
  const auto synced =
      std::count_if(calls.begin(), calls.end(), [](const auto& c) { return c.what == What::kSynced; });
  if (synced < 10 || whole.size() < 100 || calls.back().size_bytes != static_cast<std::int64_t>(log.size())) {
    fmt::print("{} syncs of {} messages in {} bytes: no recording of this log\n", synced, whole.size(),
               log.size());
    return 2;
  }
  std::int64_t longest_sync_ns = 0;
  for (const auto& c : calls)
    if (c.what == What::kSynced) longest_sync_ns = std::max(longest_sync_ns, c.end_ns - c.begin_ns);
  const std::int64_t start_ns = start_of(calls, log, scratch);
  const std::int64_t flight_ns = last_ns(whole);
  int bad = 0;
  int torn = 0;
  std::int64_t most_lost_ns = 0;
  for (int i = 0; i < cuts; ++i) {
    const std::int64_t at_ns = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(flight_ns));
    const std::string left = left_at(start_ns + at_ns, calls, log, random);
    if (log.compare(0, left.size(), left) != 0) ++torn;
    const std::vector<Entry> entries = entries_of(scratch, left);
    const std::int64_t lost_ns = at_ns - last_ns(entries);
    most_lost_ns = std::max(most_lost_ns, lost_ns);
    const bool prefix =
        entries.size() <= whole.size() && std::equal(entries.begin(), entries.end(), whole.begin());
    if (prefix && lost_ns <= kMostLost_ns) continue;
    ++bad;
    fmt::print("cut at {:.3f} s: {:.3f} s lost{}\n", 1e-9 * static_cast<double>(at_ns),
               1e-9 * static_cast<double>(lost_ns), prefix ? "" : ", and messages that nobody wrote");
  }
  std::filesystem::remove(scratch);
  fmt::print(
      "{} cuts in {:.1f} s of flight ({} with torn pages): at most {:.3f} s lost, longest sync {:.3f} s, {} "
      "bad\n",
      cuts, 1e-9 * static_cast<double>(flight_ns), torn, 1e-9 * static_cast<double>(most_lost_ns),
      1e-9 * static_cast<double>(longest_sync_ns), bad);
  if (torn == 0) fmt::print("no cut tore anything: nothing was tried\n");
  return bad == 0 && torn > 0 ? 0 : 1;
}
