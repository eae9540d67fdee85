#include "platform/log/mcap_records.hpp"

namespace roborun::log {

std::string bytes_of(const Schema& schema) {
  std::string bytes;
  Put(bytes).number(schema.id).text(schema.name).text(schema.encoding).text(schema.data);
  return bytes;
}

std::string bytes_of(const Channel& channel) {
  std::string bytes;
  Put(bytes)
      .number(channel.id)
      .number(channel.schema_id)
      .text(channel.topic)
      .text(channel.message_encoding)
      .map(channel.metadata);
  return bytes;
}

std::string bytes_of(const Metadata& metadata) {
  std::string bytes;
  Put(bytes).text(metadata.name).map(metadata.values);
  return bytes;
}

std::string bytes_of(const Statistics& s) {
  std::string counts;
  for (const auto& [channel, count] : s.by_channel) Put(counts).number(channel).number(count);
  std::string bytes;
  Put(bytes).number(s.messages).number(s.schemas).number(s.channels).number(s.attachments);
  Put(bytes).number(s.metadata).number(s.chunks).number(s.first_ns).number(s.last_ns).text(counts);
  return bytes;
}

Schema schema_from(std::string_view content) {
  Get get(content);
  Schema schema;
  schema.id = get.number<std::uint16_t>();
  schema.name = get.text();
  schema.encoding = get.text();
  schema.data = get.text();
  return schema;
}

Channel channel_from(std::string_view content) {
  Get get(content);
  Channel channel;
  channel.id = get.number<std::uint16_t>();
  channel.schema_id = get.number<std::uint16_t>();
  channel.topic = get.text();
  channel.message_encoding = get.text();
  channel.metadata = get.map();
  return channel;
}

Metadata metadata_from(std::string_view content) {
  Get get(content);
  Metadata metadata;
  metadata.name = get.text();
  metadata.values = get.map();
  return metadata;
}

Statistics statistics_from(std::string_view content) {
  Get get(content);
  Statistics s;
  s.messages = get.number<std::uint64_t>();
  s.schemas = get.number<std::uint16_t>();
  s.channels = get.number<std::uint32_t>();
  s.attachments = get.number<std::uint32_t>();
  s.metadata = get.number<std::uint32_t>();
  s.chunks = get.number<std::uint32_t>();
  s.first_ns = get.number<std::uint64_t>();
  s.last_ns = get.number<std::uint64_t>();
  for (Get inner(get.text()); !inner.rest().empty();) {
    const auto channel = inner.number<std::uint16_t>();
    s.by_channel[channel] = inner.number<std::uint64_t>();
  }
  return s;
}

}  // namespace roborun::log
