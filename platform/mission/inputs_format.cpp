#include "platform/mission/inputs_format.hpp"

#include <cmath>

#include "platform/input/input_error.hpp"
#include "platform/log/crc32.hpp"
#include "platform/log/mcap_records.hpp"
#include "platform/log/word_coding.hpp"

namespace roborun::mission {
namespace {

constexpr std::size_t kMostRecords = 1U << 20U;

struct Words {
  std::size_t head_bytes, stride;
};
/// Of a kind whose size is not always the same.
constexpr Words words_of(RecordKind kind) {
  if (kind == RecordKind::kDepth) return {kDepthHead_bytes, 1};
  if (kind == RecordKind::kLidar) return {kLidarHead_bytes, 3};
  return {0, 6};  // goals: three doubles each
}

constexpr const RecordSize& size_of(RecordKind kind) { return kRecordSizes[static_cast<std::size_t>(kind)]; }

/// Records of one size as columns of differences.
void append_columns(std::string& to, std::string_view payloads, std::size_t size) {
  if (payloads.empty()) return;
  for (std::size_t byte = 0; byte < size; ++byte) {
    char before = 0;
    for (std::size_t at = byte; at < payloads.size(); at += size) {
      to += static_cast<char>(payloads[at] - before);
      before = payloads[at];
    }
  }
}

std::string rows_of(std::string_view columns, std::size_t size) {
  std::string rows(columns.size(), '\0');
  const std::size_t count = columns.size() / size;
  for (std::size_t byte = 0; byte < size; ++byte) {
    char before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      before = static_cast<char>(before + columns[byte * count + i]);
      rows[i * size + byte] = before;
    }
  }
  return rows;
}

}  // namespace

MotorsCheck check_of(const firmware_if::MotorCommand& command) noexcept {
  constexpr double kMost = 65535.0;
  MotorsCheck check;
  check.crc =
      log::crc32({reinterpret_cast<const char*>(command.thrust_ratio.data()), sizeof command.thrust_ratio});
  for (std::size_t i = 0; i < check.ratio.size(); ++i) {
    const double ratio = command.thrust_ratio[i];
    check.ratio[i] = static_cast<std::uint16_t>(ratio > 0.0 ? std::lround(std::fmin(ratio, 1.0) * kMost) : 0);
  }
  return check;
}

void InputBatch::add(RecordKind kind, std::string_view payload) {
  kinds_ += static_cast<char>(kind);
  bytes_ += 1 + payload.size();
  if (size_of(kind).is_fixed()) {
    payloads_[static_cast<std::size_t>(kind)].append(payload);
    return;
  }
  const Words words = words_of(kind);
  log::Put(others_).number(static_cast<std::uint32_t>(payload.size()));
  others_.append(payload.substr(0, words.head_bytes));
  log::append_coded_words(others_, payload.substr(words.head_bytes), words.stride);
}

std::string InputBatch::take() {
  std::string message;
  log::Put(message).text(kinds_);
  for (std::size_t kind = 0; kind < kRecordKinds; ++kind) {
    append_columns(message, payloads_[kind], kRecordSizes[kind].most);
    payloads_[kind].clear();
  }
  message += others_;
  others_.clear();
  kinds_.clear();
  bytes_ = 0;
  return message;
}

InputRecords records_from(std::string_view message) {
  log::Get get(message);
  const std::string_view kinds = get.text();
  if (kinds.size() > kMostRecords) throw InputError("inputs: too many records");
  std::array<std::size_t, kRecordKinds> count{};
  for (const char kind : kinds) {
    if (static_cast<std::uint8_t>(kind) >= kRecordKinds)
      throw InputError("inputs: an unknown kind of record");
    ++count[static_cast<std::uint8_t>(kind)];
  }
  std::array<std::string, kRecordKinds> rows;
  for (std::size_t kind = 0; kind < kRecordKinds; ++kind) {
    const RecordSize& size = kRecordSizes[kind];
    if (size.is_fixed() && size.most > 0) rows[kind] = rows_of(get.bytes(count[kind] * size.most), size.most);
  }
  InputRecords inputs;
  inputs.payloads.reserve(message.size());
  std::array<std::size_t, kRecordKinds> taken{};
  for (const char one : kinds) {
    const auto kind = static_cast<RecordKind>(one);
    const RecordSize& size = size_of(kind);
    const std::size_t at = inputs.payloads.size();
    if (size.is_fixed()) {
      std::size_t& from = taken[static_cast<std::size_t>(kind)];
      inputs.payloads.append(rows[static_cast<std::size_t>(kind)], from, size.most);
      from += size.most;
    } else {
      const auto bytes = get.number<std::uint32_t>();
      const Words words = words_of(kind);
      if (bytes < size.least || bytes > size.most || (bytes - words.head_bytes) % (4 * words.stride) > 0)
        throw InputError("inputs: a record of another size");
      inputs.payloads.append(get.bytes(words.head_bytes));
      log::append_decoded_words(inputs.payloads, get.bytes(bytes - words.head_bytes), words.stride);
    }
    inputs.records.push_back({kind, at, inputs.payloads.size() - at});
  }
  if (!get.rest().empty()) throw InputError("inputs: more bytes than records");
  return inputs;
}

}  // namespace roborun::mission
