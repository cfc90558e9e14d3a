#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/stop_signal.h"
#include "sovo/app/terminal_line.h"
#include "sovo/bridge/recorder.h"

namespace sovo::app {
namespace {

using bridge::RecordingState;

/// What the user sees of a recorder while it runs.
class RecorderView {
 public:
  void update(const bridge::Recorder& recorder) {
    for (const std::string& topic : recorder.unknown_topics()) {
      if (!named_.insert(topic).second) continue;
      spdlog::warn("{} is not recorded: its type is not known", topic);
    }
    const RecordingState state = recorder.state();
    if (state.recording && state.file != file_) {
      file_ = state.file;
      spdlog::info("recording to {}", file_);
    }
    if (!state.recording && was_recording_) tell_end(state);
    was_recording_ = state.recording;
    line_.show(text(state));
  }

 private:
  using Clock = std::chrono::steady_clock;

  void tell_end(const RecordingState& state) {
    spdlog::log(state.failed ? spdlog::level::err : spdlog::level::info,
                "recording ended: {}; {} messages, {}, {} dropped", state.reason, state.messages,
                size_text(state.bytes), state.dropped);
    for (const auto& [topic, count] : state.drops) spdlog::warn("{}: {} dropped", topic, count);
    file_.clear();
  }

  std::string text(const RecordingState& state) {
    if (!state.recording) return "waiting for record_command";
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    if (seconds >= 1.0) {
      const std::uint64_t grown = state.bytes - std::min(state.bytes, last_bytes_);
      rate_ = static_cast<std::uint64_t>(static_cast<double>(grown) / seconds);
      last_ = now;
      last_bytes_ = state.bytes;
    }
    return fmt::format("{}  {}  {}/s  {} messages  {} dropped  {} free", state.file,
                       size_text(state.bytes), size_text(rate_), state.messages, state.dropped,
                       size_text(free_bytes(state.file)));
  }

  std::set<std::string> named_;
  std::string file_;
  bool was_recording_ = false;
  TerminalLine line_;
  Clock::time_point last_ = Clock::now();
  std::uint64_t last_bytes_ = 0;
  std::uint64_t rate_ = 0;
};

int record(const AppConfig& config) {
  StopSignal stop;  // before the threads of the bus
  auto participant = bridge::Participant::open(config.dds, "record");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);
  auto recorder = bridge::Recorder::open(*participant, config.record);
  if (!recorder) return fail(kUsage, recorder.error());
  if (!config.record.wait) {
    if (auto started = (*recorder)->start(); !started) return fail(kFailed, started.error());
  } else {
    spdlog::info("waiting for record_command");
  }
  RecorderView view;
  while (!stop.requested()) {
    (*recorder)->poll();
    view.update(**recorder);
    if (const std::string failure = (*recorder)->failure(); !failure.empty()) {
      (*recorder)->stop(failure);
      view.update(**recorder);
      return fail(kFailed, failure);
    }
    const RecordingState state = (*recorder)->state();
    if (!config.record.wait && state.failed) {
      (*recorder)->publish_status();
      return kFailed;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  (*recorder)->stop("stopped by the user");
  view.update(**recorder);
  (*recorder)->publish_status();
  return (*recorder)->state().failed ? kFailed : kOk;
}

}  // namespace

void add_record_command(const Command& program) {
  const Command command = program.add_command("record", "Record topics of the bus");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("-o,--out", "record.out", "Folder of the recording, or one file", "DIR|X.mcap")
      .flag("--ros-images", "record.ros_images", "Write stereo frames as Image and CameraInfo")
      .value("--topics", "record.topics",
             "Topics beside the default set; all: every known type; -A: not that one", "A,B")
      .value("--split", "record.split", "Begin another file beyond this size", "SIZE")
      .value("--min-free", "record.min_free", "End when the disk has less left", "SIZE")
      .value("--compression", "record.compression", "Of the chunks", "none|lz4|zstd")
      .flag("--wait", "record.wait", "Begin when record_command says so");
  add_dds_options(*options);
  command.action([options] {
    const auto config = options->load();
    return config ? record(*config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
