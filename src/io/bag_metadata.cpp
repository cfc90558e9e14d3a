#include "sovo/io/bag_metadata.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>

namespace sovo {
namespace {

constexpr int kHumbleVersion = 5;

void emit_time(YAML::Emitter& out, const char* key, const char* unit, std::uint64_t ns) {
  out << YAML::Key << key << YAML::Value << YAML::BeginMap << YAML::Key << unit << YAML::Value << ns
      << YAML::EndMap;
}

void emit_topic(YAML::Emitter& out, const BagMetadata::Topic& topic) {
  out << YAML::BeginMap << YAML::Key << "topic_metadata" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << topic.name;
  out << YAML::Key << "type" << YAML::Value << topic.type;
  out << YAML::Key << "serialization_format" << YAML::Value << "cdr";
  out << YAML::Key << "offered_qos_profiles" << YAML::Value << YAML::DoubleQuoted
      << topic.offered_qos;
  out << YAML::EndMap;
  out << YAML::Key << "message_count" << YAML::Value << topic.messages << YAML::EndMap;
}

void emit_file(YAML::Emitter& out, const BagMetadata::File& file) {
  out << YAML::BeginMap << YAML::Key << "path" << YAML::Value << file.name;
  emit_time(out, "starting_time", "nanoseconds_since_epoch", file.start_ns);
  emit_time(out, "duration", "nanoseconds", file.end_ns - file.start_ns);
  out << YAML::Key << "message_count" << YAML::Value << file.messages << YAML::EndMap;
}

}  // namespace

std::string to_yaml(const BagMetadata& metadata) {
  std::uint64_t start = 0;
  std::uint64_t end = 0;
  std::uint64_t messages = 0;
  for (const auto& file : metadata.files) {
    if (file.messages == 0) continue;
    start = messages == 0 ? file.start_ns : std::min(start, file.start_ns);
    end = std::max(end, file.end_ns);
    messages += file.messages;
  }
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "rosbag2_bagfile_information" << YAML::Value
      << YAML::BeginMap;
  out << YAML::Key << "version" << YAML::Value << kHumbleVersion;
  out << YAML::Key << "storage_identifier" << YAML::Value << "mcap";
  emit_time(out, "duration", "nanoseconds", end - start);
  emit_time(out, "starting_time", "nanoseconds_since_epoch", start);
  out << YAML::Key << "message_count" << YAML::Value << messages;
  out << YAML::Key << "topics_with_message_count" << YAML::Value << YAML::BeginSeq;
  for (const auto& topic : metadata.topics) emit_topic(out, topic);
  out << YAML::EndSeq;
  out << YAML::Key << "compression_format" << YAML::Value << YAML::DoubleQuoted << "";
  out << YAML::Key << "compression_mode" << YAML::Value << YAML::DoubleQuoted << "";
  out << YAML::Key << "relative_file_paths" << YAML::Value << YAML::BeginSeq;
  for (const auto& file : metadata.files) out << file.name;
  out << YAML::EndSeq << YAML::Key << "files" << YAML::Value << YAML::BeginSeq;
  for (const auto& file : metadata.files) emit_file(out, file);
  out << YAML::EndSeq << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace sovo
