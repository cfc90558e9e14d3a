#include "sovo/io/mcap_format.h"

#include <zlib.h>

#include <algorithm>
#include <limits>

namespace sovo::mcap {
namespace {

/// Length in bytes, then as many of `read_one` as it holds.
template <class F>
void read_array(ByteReader* in, F&& read_one) {
  ByteReader items(in->raw(in->u32()));
  while (items.left() > 0 && items.ok()) read_one(&items);
  if (!items.ok()) (void)in->raw(std::numeric_limits<std::uint64_t>::max());  // marks it as broken
}

std::map<std::uint16_t, std::uint64_t> read_counts(ByteReader* in) {
  std::map<std::uint16_t, std::uint64_t> result;
  read_array(in, [&](ByteReader* items) {
    const std::uint16_t key = items->u16();
    result[key] = items->u64();
  });
  return result;
}

}  // namespace

void ByteWriter::text_map(const std::map<std::string, std::string>& v) {
  ByteWriter items;
  for (const auto& [key, value] : v) {
    items.text(key);
    items.text(value);
  }
  u32(static_cast<std::uint32_t>(items.size()));
  raw(items.bytes_);
}

std::map<std::string, std::string> ByteReader::text_map() {
  std::map<std::string, std::string> result;
  read_array(this, [&](ByteReader* items) {
    const std::string key = items->text();
    result[key] = items->text();
  });
  return result;
}

ByteWriter to_body(const Schema& schema) {
  ByteWriter out;
  out.u16(schema.id);
  out.text(schema.name);
  out.text(schema.encoding);
  out.text(schema.data);
  return out;
}

ByteWriter to_body(const Channel& channel) {
  ByteWriter out;
  out.u16(channel.id);
  out.u16(channel.schema_id);
  out.text(channel.topic);
  out.text(channel.message_encoding);
  out.text_map(channel.metadata);
  return out;
}

ByteWriter to_body(const ChunkIndex& index) {
  ByteWriter out;
  out.u64(index.start_ns);
  out.u64(index.end_ns);
  out.u64(index.offset);
  out.u64(index.length);
  out.u32(static_cast<std::uint32_t>(index.message_index_offsets.size() * 10));
  for (const auto& [channel, offset] : index.message_index_offsets) {
    out.u16(channel);
    out.u64(offset);
  }
  out.u64(index.message_index_length);
  out.text(index.compression);
  out.u64(index.compressed_size);
  out.u64(index.uncompressed_size);
  return out;
}

ByteWriter to_body(const AttachmentIndex& index) {
  ByteWriter out;
  out.u64(index.offset);
  out.u64(index.length);
  out.u64(index.log_ns);
  out.u64(index.create_ns);
  out.u64(index.data_size);
  out.text(index.name);
  out.text(index.media_type);
  return out;
}

ByteWriter to_body(const MetadataIndex& index) {
  ByteWriter out;
  out.u64(index.offset);
  out.u64(index.length);
  out.text(index.name);
  return out;
}

bool from_body(ByteSpan body, Schema* schema) {
  ByteReader in(body);
  schema->id = in.u16();
  schema->name = in.text();
  schema->encoding = in.text();
  schema->data = in.text();
  return in.ok() && schema->id != 0;
}

bool from_body(ByteSpan body, Channel* channel) {
  ByteReader in(body);
  channel->id = in.u16();
  channel->schema_id = in.u16();
  channel->topic = in.text();
  channel->message_encoding = in.text();
  channel->metadata = in.text_map();
  return in.ok();
}

bool from_body(ByteSpan body, ChunkIndex* index) {
  ByteReader in(body);
  index->start_ns = in.u64();
  index->end_ns = in.u64();
  index->offset = in.u64();
  index->length = in.u64();
  index->message_index_offsets = read_counts(&in);
  index->message_index_length = in.u64();
  index->compression = in.text();
  index->compressed_size = in.u64();
  index->uncompressed_size = in.u64();
  return in.ok();
}

bool from_body(ByteSpan body, AttachmentIndex* index) {
  ByteReader in(body);
  index->offset = in.u64();
  index->length = in.u64();
  index->log_ns = in.u64();
  index->create_ns = in.u64();
  index->data_size = in.u64();
  index->name = in.text();
  index->media_type = in.text();
  return in.ok();
}

bool from_body(ByteSpan body, MetadataIndex* index) {
  ByteReader in(body);
  index->offset = in.u64();
  index->length = in.u64();
  index->name = in.text();
  return in.ok();
}

bool from_body(ByteSpan body, Statistics* statistics) {
  ByteReader in(body);
  statistics->messages = in.u64();
  in.raw(2 + 4 + 4 + 4 + 4);  // numbers of schemas, channels, attachments, metadata, chunks
  statistics->start_ns = in.u64();
  statistics->end_ns = in.u64();
  statistics->channel_messages = read_counts(&in);
  return in.ok();
}

std::uint32_t crc32(ByteSpan bytes, std::uint32_t crc) {
  uLong value = crc;
  while (!bytes.empty()) {
    const std::size_t part = std::min<std::size_t>(bytes.size(), 1U << 30);
    value = ::crc32(value, bytes.data(), static_cast<uInt>(part));
    bytes = bytes.subspan(part);
  }
  return static_cast<std::uint32_t>(value);
}

}  // namespace sovo::mcap
