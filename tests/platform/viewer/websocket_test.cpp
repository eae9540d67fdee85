#include "platform/viewer/websocket.hpp"

#include <gtest/gtest.h>

namespace roborun::viewer {
namespace {

using Status = FrameReader::Status;

TEST(WebSocket, AnswersTheKeyOfTheRfc) {
  EXPECT_EQ(accept_key("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");  // RFC 6455, 1.3
}

TEST(WebSocket, WritesTheThreeFormsOfALength) {
  for (const std::size_t size : {0U, 125U, 126U, 65535U, 65536U, 70000U}) {
    std::string frame;
    append_frame(frame, Opcode::kBinary, std::string(size, 'x'));
    const std::size_t head = size < 126 ? 2U : size < 65536 ? 4U : 10U;
    ASSERT_EQ(frame.size(), head + size);
    EXPECT_EQ(frame[0], '\x82');
    EXPECT_EQ(static_cast<std::uint8_t>(frame[1]), size < 126 ? size : size < 65536 ? 126U : 127U);
    if (head == 4) {
      EXPECT_EQ(static_cast<std::uint8_t>(frame[2]) * 256U + static_cast<std::uint8_t>(frame[3]), size);
    }
  }
}

TEST(WebSocket, ReadsMessagesThatComeInAnyPieces) {
  std::string stream = masked_frame(Opcode::kText, "Hello");
  stream += masked_frame(Opcode::kText, std::string(300, 'a'), false);
  stream += masked_frame(Opcode::kPing, "p");
  stream += masked_frame(Opcode::kContinue, std::string(300, 'b'));
  stream += masked_frame(Opcode::kBinary, "");
  for (const std::size_t step : {std::size_t{1}, std::size_t{7}, stream.size()}) {
    FrameReader sut;
    std::vector<FrameReader::Message> got;
    for (std::size_t at = 0; at < stream.size(); at += step) {
      sut.feed(std::string_view(stream).substr(at, step));
      FrameReader::Message message;
      Status status = Status::kMore;
      while ((status = sut.next(message)) == Status::kMessage) got.push_back(message);
      ASSERT_EQ(status, Status::kMore);
    }
    ASSERT_EQ(got.size(), 4U) << step;
    EXPECT_EQ(got[0].payload, "Hello");
    EXPECT_EQ(got[1].opcode, Opcode::kPing) << "between the pieces of a message";
    EXPECT_EQ(got[2].opcode, Opcode::kText);
    EXPECT_EQ(got[2].payload, std::string(300, 'a') + std::string(300, 'b'));
    EXPECT_EQ(got[3].opcode, Opcode::kBinary);
  }
}

TEST(WebSocket, RefusesForEverWhatIsAgainstTheProtocol) {
  std::string too_long;
  for (int i = 0; i < 3; ++i)
    too_long += masked_frame(i == 0 ? Opcode::kText : Opcode::kContinue, std::string(30000, 'x'), false);
  const std::string good = masked_frame(Opcode::kText, "x");
  std::string unmasked = good;
  unmasked[1] = static_cast<char>(unmasked[1] & 0x7F);
  std::string reserved = good;
  reserved[0] = static_cast<char>(reserved[0] | 0x40);
  std::string huge = good;
  huge[1] = '\xFF';
  for (const std::string& bad :
       {unmasked, reserved, huge, too_long, masked_frame(static_cast<Opcode>(3), "x"),
        masked_frame(Opcode::kPing, "x", false), masked_frame(Opcode::kPing, std::string(126, 'x')),
        masked_frame(Opcode::kContinue, "x"),
        masked_frame(Opcode::kText, "x", false) + masked_frame(Opcode::kText, "x")}) {
    FrameReader sut;
    sut.feed(bad);
    FrameReader::Message message;
    EXPECT_EQ(sut.next(message), Status::kBad);
    sut.feed(good);
    EXPECT_EQ(sut.next(message), Status::kBad);
  }
}

}  // namespace
}  // namespace roborun::viewer
