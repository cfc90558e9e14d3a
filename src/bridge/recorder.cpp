#include "sovo/bridge/recorder.h"

#include <algorithm>
#include <cctype>
#include <ctime>
#include <filesystem>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/io/text.h"

namespace sovo::bridge {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRecordedIds = 1024;
constexpr std::size_t kLongestName = 100;
constexpr char kExtension[] = ".mcap";

/// A name from the network becomes a file: no folder, nothing hidden.
bool is_plain_name(const std::string& name) {
  return name.size() <= kLongestName && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
         });
}

std::string date_and_time() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y%m%d_%H%M%S", &utc);
  return text;
}

std::vector<std::string> names_in(const std::string& topics) {
  std::vector<std::string> names;
  for (const std::string_view name : split(topics, ", ")) names.emplace_back(name);
  return names;
}

}  // namespace

Recorder::Recorder(const Participant& participant, const RecorderConfig& config,
                   const RecorderSizes& sizes, Reader<msg::RecorderCommand> commands,
                   Writer<msg::RecorderStatus> status)
    : config_(config),
      file_(sizes.file),
      accepts_(participant.accepts_commands()),
      commands_(std::move(commands)),
      status_(std::move(status)),
      thread_(sizes.queue_bytes,
              config.ros_images ? participant.topic(topics::kStereo) : std::string()) {}

Result<std::unique_ptr<Recorder>> Recorder::open(const Participant& participant,
                                                 const RecorderConfig& config) {
  const auto sizes = read_sizes(config);
  if (!sizes) return sizes.failure();
  auto commands = Reader<msg::RecorderCommand>::open(participant, topics::kRecordCommand,
                                                     topics::kRecordCommandQos);
  if (!commands) return commands.failure();
  auto status = Writer<msg::RecorderStatus>::open(participant, topics::kRecordStatus,
                                                  topics::kRecordStatusQos);
  if (!status) return status.failure();
  std::unique_ptr<Recorder> recorder(
      new Recorder(participant, config, *sizes, std::move(*commands), std::move(*status)));
  auto capture =
      TopicCapture::open(participant, names_in(config.topics),
                         [raw = recorder.get()](const std::shared_ptr<const CapturedTopic>& topic,
                                                CdrSample sample, std::int64_t log_ns) {
                           raw->thread_.push(topic, std::move(sample), log_ns);
                         });
  if (!capture) return capture.failure();
  recorder->capture_ = std::move(*capture);
  return recorder;
}

std::string Recorder::path_of(const std::string& name) const {
  fs::path path(config_.out);
  if (path.has_relative_path() && !path.has_filename()) path = path.parent_path();  // "dive/"
  const std::string extension = path.extension() == kExtension ? kExtension : "";
  const std::string stem = extension.empty() ? path.filename().string() : path.stem().string();
  if (!name.empty()) return (path.parent_path() / (name + extension)).string();
  std::error_code error;
  if (!fs::exists(path, error)) return path.string();
  const std::string dated = stem + "_" + date_and_time() + extension;
  return (path.parent_path() / dated).string();
}

Result<void> Recorder::start(const std::string& name) {
  return thread_.start(path_of(name), file_);
}

void Recorder::poll() {
  (void)commands_.take_each(
      [this](const msg::RecorderCommand& command, const dds_sample_info_t&) { obey(command); });
  const auto now = std::chrono::steady_clock::now();
  if (now < next_status_) return;
  next_status_ = now + std::chrono::seconds(1);
  publish_status();
}

void Recorder::obey(const msg::RecorderCommand& command) {
  using Traits = MessageTraits<msg::RecorderCommand>;
  if (std::find(known_ids_.begin(), known_ids_.end(), command.id) != known_ids_.end()) return;
  known_ids_.push_back(command.id);
  if (known_ids_.size() > kMostRecordedIds) known_ids_.pop_front();
  last_command_id_ = command.id;
  refusal_.clear();
  next_status_ = {};  // the answer goes out at once
  const std::string name = command.name == nullptr ? "" : command.name;
  if (!accepts_) {
    refusal_ = "refused: commands from a network are obeyed only with accept_commands: true";
  } else if (command.command == Traits::STOP) {
    thread_.stop("stopped by command");
  } else if (command.command != Traits::START) {
    refusal_ =
        "refused: command " + std::to_string(command.command) + " is not 1 (start) or 2 (stop)";
  } else if (state().recording) {
    refusal_ = "refused: it is recording already";
  } else if (!name.empty() && !is_plain_name(name)) {
    refusal_ = "refused: a name has letters, digits, '_', '-' and '.' only";
  } else if (auto started = start(name); !started) {
    refusal_ = started.error();
  }
}

void Recorder::publish_status() {
  const RecordingState state = thread_.state();
  const std::string reason = refusal_.empty() ? state.reason : refusal_;
  msg::RecorderStatus message{};
  message.header.stamp = to_message(dds_time());
  message.header.frame_id = borrow("");
  message.recording = state.recording;
  message.file = borrow(state.file);
  message.reason = borrow(reason);
  message.last_command_id = last_command_id_;
  message.bytes = state.bytes;
  message.free_bytes = free_bytes(state.file.empty() ? config_.out : state.file);
  message.dropped = state.dropped;
  (void)status_.write(message);
}

}  // namespace sovo::bridge
