/// A log for tests of readers: three channels, chunks of a second, half of its bytes noise.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "platform/input/input_error.hpp"
#include "platform/log/mcap_reader.hpp"
#include "platform/log/mcap_writer.hpp"

namespace roborun::log::test {

class MemorySink final : public ByteSink {
 public:
  [[nodiscard]] bool append(std::string_view more) noexcept override {
    if (refusals > 0 && refusals-- > 0) return false;
    bytes += more;
    ++appends;
    ends.push_back(bytes.size());
    return true;
  }
  std::string bytes;
  std::vector<std::size_t> ends;  ///< Behind each append.
  int appends{0};
  int refusals{0};  ///< So many appends from now on fail.
};

struct Read {
  std::vector<std::pair<std::string, std::string>> messages;  ///< Topic and data.
  std::vector<std::uint32_t> sequence;
  std::string damage;
};

/// Everything that there is to read. What the constructor refuses is damage, too.
inline Read read_all(const std::string& path) {
  Read read;
  try {
    McapReader reader(path);
    for (Message message; reader.next(message);) {
      read.messages.emplace_back(message.channel->topic, message.data);
      read.sequence.push_back(message.sequence);
    }
    read.damage = reader.damage();
  } catch (const InputError& error) {
    read.damage = error.what();
  }
  return read;
}

inline std::string noise(std::uint64_t seed, std::size_t bytes) {
  std::string text;
  for (std::uint64_t state = seed * 2 + 1; text.size() < bytes;) {
    state = state * 6364136223846793005U + 1442695040888963407U;  // Knuth's linear congruence
    text += static_cast<char>(state >> 56U);
  }
  return text;
}

/// `seconds` chunks of 10 messages, each of about `bytes`.
inline constexpr std::uint64_t kStep_ns = 100'000'000;
inline MemorySink sample_log(int seconds, std::size_t bytes) {
  MemorySink sink;
  McapWriter writer(sink, "", "sample");
  const std::uint16_t schema = writer.add_schema("Sample", "jsonschema", R"({"type":"object"})");
  const std::uint16_t first = writer.add_channel(schema, "/first", "json");
  const std::uint16_t second = writer.add_channel(schema, "/second", "json", {{"unit", "m"}});
  const std::uint16_t third = writer.add_channel(0, "/third", "x");
  writer.add_metadata({"start", {{"seed", "1"}, {"vehicle", "paper"}}});
  for (int i = 0; i < 10 * seconds; ++i) {
    const auto time_ns = static_cast<std::uint64_t>(i) * kStep_ns;
    const std::string text = R"({"number":)" + std::to_string(i) + "}";
    if (i % 2 == 0)
      writer.message(first, time_ns, text);
    else if (i % 4 == 1)
      writer.message(second, time_ns, text + std::string(bytes, 'a'));
    else
      writer.message(third, time_ns, noise(static_cast<std::uint64_t>(i), 4 * bytes));
  }
  writer.finish();
  return sink;
}

}  // namespace roborun::log::test
