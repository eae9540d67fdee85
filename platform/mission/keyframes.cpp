#include "platform/mission/keyframes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <utility>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/input/output_file.hpp"
#include "platform/input/text_file.hpp"
#include "platform/log/compression.hpp"
#include "platform/log/crc32.hpp"
#include "platform/log/mcap_records.hpp"
#include "platform/mission/flight_memory.hpp"
#include "platform/report/sha256.hpp"

namespace roborun::mission {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostChanges_bytes = std::size_t{1} << 30U;
constexpr const char* kEnding = ".keyframe";

/// The files of the folder that keyframes are in. None if it cannot be read.
template <typename F>
void each_file(const std::string& folder, F&& f) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == kEnding) f(entry);
}

void remove_oldest(const std::string& folder) {
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  std::uint64_t bytes = 0;
  std::error_code error;
  each_file(folder, [&](const fs::directory_entry& entry) {
    bytes += entry.file_size(error);
    files.emplace_back(entry.last_write_time(error), entry.path());
  });
  std::sort(files.begin(), files.end());
  for (auto file = files.begin(); bytes > Keyframes::kMost_bytes && file != files.end(); ++file) {
    bytes -= fs::file_size(file->second, error);
    fs::remove(file->second, error);
  }
}

}  // namespace

Keyframes::Keyframes(std::string folder, std::string_view configuration) : folder_(std::move(folder)) {
  const std::string program = program_build_id();
  if (folder_.empty() || program.empty()) return;
  prefix_ = report::sha256(program + std::string(configuration)).substr(0, 32) + "-";
}

std::optional<Keyframe> Keyframes::before(std::uint64_t frames) const {
  if (prefix_.empty()) return {};
  std::optional<std::uint64_t> latest;
  each_file(folder_, [&](const fs::directory_entry& entry) {
    const std::string name = entry.path().stem().string();
    std::uint64_t number = 0;
    if (name.rfind(prefix_, 0) != 0) return;
    const auto read = std::from_chars(name.data() + prefix_.size(), name.data() + name.size(), number);
    if (read.ec == std::errc() && number < frames && (!latest || number > *latest)) latest = number;
  });
  if (!latest) return {};
  try {
    const std::string text = input::read_text(path_of(*latest), "a keyframe", kMostChanges_bytes);
    log::Get get(text);
    if (get.number<std::uint32_t>() != log::crc32(get.rest())) return {};
    Keyframe keyframe;
    keyframe.frames = *latest;
    keyframe.position.chunk_at = get.number<std::uint64_t>();
    for (std::uint32_t* const x :
         {&keyframe.position.sequence, &keyframe.position.crc, &keyframe.position.record})
      *x = get.number<std::uint32_t>();
    const auto bytes = get.number<std::uint64_t>();
    if (bytes > kMostChanges_bytes) return {};
    log::Decompressor().run(keyframe.changes, get.rest(), static_cast<std::size_t>(bytes));
    return keyframe;
  } catch (const InputError&) {
    return {};
  }
}

std::string Keyframes::path_of(std::uint64_t frames) const {
  return fmt::format("{}/{}{}{}", folder_, prefix_, frames, kEnding);
}

bool Keyframes::has(std::uint64_t frames) const {
  std::error_code error;
  return fs::exists(path_of(frames), error);
}

void Keyframes::keep(const Keyframe& keyframe) const noexcept {
  if (prefix_.empty()) return;
  try {
    fs::create_directories(folder_);
    fs::permissions(folder_, fs::perms::owner_all);
    std::string text;
    const InputsPosition& at = keyframe.position;
    log::Put(text).number(at.chunk_at).number(at.sequence).number(at.crc).number(at.record);
    log::Put(text).number(std::uint64_t{keyframe.changes.size()});
    text += log::Compressor().run(keyframe.changes, log::kLevelOfNoise);
    std::string crc;
    log::Put(crc).number(log::crc32(text));
    input::OutputFile file(path_of(keyframe.frames));
    file.write(crc);
    file.write(text);
    file.commit();
    remove_oldest(folder_);
  } catch (const std::exception&) {  // no room, no right: then the next replay takes longer
  }
}

}  // namespace roborun::mission
