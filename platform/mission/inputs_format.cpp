#include "platform/mission/inputs_format.hpp"

#include <fmt/format.h>

#include <cmath>

#include "platform/input/input_error.hpp"
#include "platform/log/crc32.hpp"
#include "platform/log/mcap_records.hpp"

namespace roborun::mission {
namespace {

constexpr std::size_t kMostRecords = 1U << 20U;
constexpr std::uint32_t kMostRecords_bytes = 1U << 26U;

constexpr const RecordSize& size_of(RecordKind kind) { return kRecordSizes[static_cast<std::size_t>(kind)]; }

/// The heads of records of one size as columns of differences.
void append_columns(std::string& to, std::string_view payloads, const RecordSize& size) {
  for (std::size_t byte = 0; byte < size.head; ++byte) {
    char before = 0;
    for (std::size_t at = byte; at < payloads.size(); at += size.most) {
      to += static_cast<char>(payloads[at] - before);
      before = payloads[at];
    }
  }
}

/// Kinds of one size have words of 8 or 2 bytes, all of which are numbers.
void append_words(std::string& bits, std::string_view payloads, const RecordSize& size) {
  if (size.head == size.most) return;
  std::string words, runs;
  for (std::size_t at = 0; at < payloads.size(); at += size.most)
    words.append(payloads.substr(at + size.head, size.most - size.head));
  log::append_coded_words(runs, bits, words, size.words);
}

/// Of the words behind a head.
log::WordLayout layout_of(RecordKind kind, std::string_view head) {
  log::WordLayout layout = size_of(kind).words;
  if (kind != RecordKind::kDepth) return layout;
  std::uint16_t width = 0;
  std::memcpy(&width, head.data() + kDepthWidthAt_bytes, sizeof width);
  layout.row = width;
  return layout;
}

/// The inverse of both.
std::string rows_of(std::string_view columns, std::size_t count, const RecordSize& size,
                    std::string_view& bits) {
  std::string rows(count * size.most, '\0');
  for (std::size_t byte = 0; byte < size.head; ++byte) {
    char before = 0;
    for (std::size_t i = 0; i < count; ++i) {
      before = static_cast<char>(before + columns[byte * count + i]);
      rows[i * size.most + byte] = before;
    }
  }
  const std::size_t bytes = size.most - size.head;
  if (bytes == 0) return rows;
  std::string words;
  std::string_view no_runs;
  log::append_decoded_words(words, count * bytes / size.words.bytes, size.words, no_runs, bits);
  for (std::size_t i = 0; i < count; ++i)
    rows.replace(i * size.most + size.head, bytes, words, i * bytes, bytes);
  return rows;
}

}  // namespace

MotorsCheck check_of(const firmware_if::MotorCommand& command) noexcept {
  MotorsCheck check;
  check.crc =
      log::crc32({reinterpret_cast<const char*>(command.thrust_ratio.data()), sizeof command.thrust_ratio});
  for (std::size_t i = 0; i < check.ratio.size(); ++i) {
    const double ratio = command.thrust_ratio[i];
    check.ratio[i] =
        static_cast<std::uint16_t>(ratio > 0.0 ? std::lround(std::fmin(ratio, 1.0) * MotorsCheck::kMost) : 0);
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
  const RecordSize& size = size_of(kind);
  log::Put(heads_).number(static_cast<std::uint32_t>(payload.size()));
  const std::string_view head = payload.substr(0, size.head);
  heads_ += head;
  log::append_coded_words(heads_, bits_, payload.substr(size.head), layout_of(kind, head));
}

std::string InputBatch::take() {
  std::string records, bits;
  log::Put(records).text(kinds_);
  for (std::size_t kind = 0; kind < kRecordKinds; ++kind) {
    append_columns(records, payloads_[kind], kRecordSizes[kind]);
    append_words(bits, payloads_[kind], kRecordSizes[kind]);
    payloads_[kind].clear();
  }
  records += heads_;
  std::string message;
  log::Put(message).number(static_cast<std::uint32_t>(records.size()));
  log::Put(message).text(compressor_.run(records, log::kLevel));
  message += bits;
  message += bits_;
  kinds_.clear();
  heads_.clear();
  bits_.clear();
  bytes_ = 0;
  return message;
}

InputRecords records_from(std::string_view message) {
  log::Get whole(message);
  const auto bytes = whole.number<std::uint32_t>();
  if (bytes > kMostRecords_bytes) throw InputError(fmt::format("inputs: records of {} bytes", bytes));
  std::string text;
  log::Decompressor().run(text, whole.text(), bytes);
  std::string_view bits = whole.rest();
  log::Get get(text);
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
    if (size.is_fixed()) rows[kind] = rows_of(get.bytes(count[kind] * size.head), count[kind], size, bits);
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
      const auto length = get.number<std::uint32_t>();
      if (length < size.least || length > size.most ||
          (length - size.head) % (size.words.bytes * size.words.stride) > 0)
        throw InputError("inputs: a record of another size");
      const std::string_view head = get.bytes(size.head);
      inputs.payloads.append(head);
      std::string_view runs = get.rest();
      log::append_decoded_words(inputs.payloads, (length - size.head) / size.words.bytes,
                                layout_of(kind, head), runs, bits);
      get = log::Get(runs);
    }
    inputs.records.push_back({kind, at, inputs.payloads.size() - at});
  }
  if (!get.rest().empty() || !bits.empty()) throw InputError("inputs: more bytes than records");
  return inputs;
}

}  // namespace roborun::mission
