/// Flight logs: the bytes of a file, or (first byte 1) the content of its records, with lengths and CRCs that are right.
/// Oracle: reading ends, whole or with the reason in one line, and counts what it gave.
#include "platform/log/crc32.hpp"
#include "platform/log/mcap_reader.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace {

using namespace roborun;

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

/// Opcode, length, content; again and again.
std::string records_of(fuzz::Choices& choices) {
  std::string file(kMagic);
  while (!choices.empty()) {
    file += static_cast<char>(choices.byte());
    const auto content = choices.take(choices.number<std::uint16_t>() % 1024U);
    const std::uint64_t size = content.size();
    for (unsigned i = 0; i < 8; ++i) file += static_cast<char>((size >> (8U * i)) & 0xffU);
    file.append(content.begin(), content.end());
  }
  return file + std::string(kMagic);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Choices choices(data, size);
  const std::string bytes = choices.byte() % 2U == 1 ? records_of(choices) : choices.text();
  const std::string path = test::scratch_file("f.mcap", bytes);
  fuzz::refuse_or([&] {
    log::McapReader reader(path);
    log::Message message;
    std::uint64_t messages = 0;
    while (reader.next(message)) {
      fuzz::require(message.channel != nullptr, "a message has a channel");
      ++messages;
    }
    fuzz::require(messages == reader.messages(), "messages are counted");
    fuzz::require(reader.damage().find('\n') == std::string::npos, "damage is one line");
    fuzz::require(!reader.next(message), "nothing comes behind the end");
  });
  return 0;
}
