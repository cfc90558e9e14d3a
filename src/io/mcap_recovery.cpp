#include "sovo/io/mcap_recovery.h"

#include <filesystem>
#include <map>
#include <system_error>

#include "sovo/io/mcap_reader.h"
#include "sovo/io/mcap_writer.h"
#include "sovo/io/recording.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// Copies messages and attachments; the number of messages.
Result<std::uint64_t> copy_all(McapReader& from, McapWriter* to) {
  for (const mcap::AttachmentIndex& attachment : from.attachments()) {
    const auto data = from.read_attachment(attachment);
    if (!data) continue;
    auto done = to->attach(attachment.name, attachment.media_type, attachment.log_ns, *data);
    if (!done) return done.failure();
  }
  for (const char* name : {kRepeatedRecord, "sovo_drops"}) {
    const auto values = from.metadata(name);
    if (!values) continue;
    if (auto done = to->add_metadata(name, *values); !done) return done.failure();
  }
  std::map<std::uint16_t, std::uint16_t> schemas;
  std::map<std::uint16_t, std::uint16_t> channels;
  std::uint64_t messages = 0;
  while (const auto message = from.next()) {
    const mcap::Channel& channel = *message->channel;
    if (!channels.contains(channel.id)) {
      const auto schema = from.schemas().find(channel.schema_id);
      if (schema != from.schemas().end() && !schemas.contains(channel.schema_id)) {
        schemas[channel.schema_id] =
            to->add_schema(schema->second.name, schema->second.encoding, schema->second.data);
      }
      const auto known = schemas.find(channel.schema_id);
      channels[channel.id] =
          to->add_channel(known == schemas.end() ? std::uint16_t{0} : known->second, channel.topic,
                          channel.metadata);
    }
    auto done = to->write(channels[channel.id], message->sequence, message->log_ns,
                          message->publish_ns, message->data);
    if (!done) return done.failure();
    ++messages;
  }
  return messages;
}

}  // namespace

Result<McapRecovery> recover_mcap(const std::string& path) {
  auto reader = McapReader::open(path);
  if (!reader) return reader.failure();
  McapRecovery recovery;
  if ((*reader)->is_indexed()) {
    recovery.was_whole = true;
    recovery.messages = (*reader)->statistics().messages;
    return recovery;
  }
  const std::string mended = path + ".mended";
  std::error_code error;
  fs::remove(mended, error);
  auto writer = McapWriter::create(mended, {});
  if (!writer) return writer.failure();
  auto copied = copy_all(**reader, writer->get());
  if (copied) {
    if (auto closed = (*writer)->close(); !closed) copied = closed.failure();
  }
  if (!copied) {
    fs::remove(mended, error);
    return copied.failure();
  }
  recovery.messages = *copied;
  recovery.notes = (*reader)->notes();
  fs::rename(path, path + ".cut", error);
  if (!error) fs::rename(mended, path, error);
  if (error) return Error{path + " cannot be replaced by " + mended + ": " + error.message()};
  return recovery;
}

}  // namespace sovo
