#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "sovo/bridge/reader.h"
#include "sovo/bridge/recorder_config.h"
#include "sovo/bridge/recording_thread.h"
#include "sovo/bridge/writer.h"

namespace sovo::bridge {

/// Records topics of the bus, says so on `record_status` and obeys `record_command`.
///
///     auto recorder = Recorder::open(participant, config);
///     recorder->start();            // or wait for a command
///     while (running) recorder->poll();   // a few times a second
///     recorder->stop("stopped by the user");
class Recorder {
 public:
  static Result<std::unique_ptr<Recorder>> open(const Participant& participant,
                                                const RecorderConfig& config);

  /// Begins to record to the configured path.
  Result<void> start() { return start(""); }
  void stop(const std::string& reason) { thread_.stop(reason); }
  /// Obeys commands and, once a second, publishes the state.
  void poll();
  /// Publishes the state now.
  void publish_status();

  RecordingState state() const { return thread_.state(); }
  /// Topics that cannot be recorded because their type is not known.
  std::vector<std::string> unknown_topics() const { return capture_->unknown(); }
  /// Why nothing is captured any more; empty while all is well.
  std::string failure() const { return capture_->failure(); }

 private:
  Recorder(const Participant& participant, const RecorderConfig& config, const RecorderSizes& sizes,
           Reader<msg::RecorderCommand> commands, Writer<msg::RecorderStatus> status);

  /// `name`: beside the configured path; empty: the path itself, or one by date and time.
  Result<void> start(const std::string& name);
  void obey(const msg::RecorderCommand& command);
  std::string path_of(const std::string& name) const;

  RecorderConfig config_;
  RecordingConfig file_;
  bool accepts_;
  Reader<msg::RecorderCommand> commands_;
  Writer<msg::RecorderStatus> status_;
  RecordingThread thread_;
  std::unique_ptr<TopicCapture> capture_;  // after the thread that it feeds
  std::deque<std::uint64_t> known_ids_;
  std::uint64_t last_command_id_ = 0;
  std::string refusal_;  // of the last command; empty when it was obeyed
  std::chrono::steady_clock::time_point next_status_{};
};

}  // namespace sovo::bridge
