#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/progress.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/recording_conversion.h"

namespace sovo::app {
namespace {

using bridge::FrameForm;

struct ConvertArguments {
  bool ros_images = false;
  bool stereo_frames = false;
};

Result<void> convert_recording(const AppConfig& config, FrameForm form, RecordingWriter& writer,
                               StopSignal& stop) {
  auto recording = Recording::open(config.camera.path);
  if (!recording) return recording.failure();
  bridge::RecordingConversionConfig wanted;
  wanted.frames = form;
  wanted.topics = {config.node.left, config.node.right, config.node.pair_tolerance_s};
  wanted.ns = config.dds.ns;
  if (!config.camera.calibration.empty()) {
    const auto calibration = load_calibration(config.camera.calibration);
    if (!calibration) return calibration.failure();
    wanted.calibration = to_cameras(*calibration);
  }
  Progress progress((*recording)->messages());
  bridge::RecordingConversion conversion(**recording, writer, wanted);
  auto done = conversion.run([&](std::uint64_t read) {
    progress.update(read, "");
    return !stop.requested();
  });
  for (const std::string& note : (*recording)->notes()) spdlog::warn("{}", note);
  for (const std::string& note : conversion.notes()) spdlog::warn("{}", note);
  return done;
}

/// A run of images becomes what a recorder would have made of them: received when they were taken.
Result<void> convert_dataset(const AppConfig& config, FrameForm form, RecordingWriter& writer,
                             StopSignal& stop) {
  auto input = open_dataset_input(config.camera, 0.0);
  if (!input) return input.failure();
  bridge::StereoRecording recording(writer, config.dds.ns, form == FrameForm::kRosImages);
  Progress progress(input->source->size());
  std::uint64_t session = 0;
  std::size_t frames = 0;
  while (!stop.requested()) {
    SourceResult next = input->source->next(std::chrono::milliseconds(100));
    if (next.state == SourceState::kEndOfStream) return {};
    if (next.state == SourceState::kFailed) return Error{next.message};
    if (next.state == SourceState::kBadFrame) spdlog::warn("frame left out: {}", next.message);
    if (next.state != SourceState::kFrame) continue;
    if (next.frame.stamp_ns < 0) return Error{"a recording has no stamps before 1970"};
    const auto stamp = static_cast<std::uint64_t>(next.frame.stamp_ns);
    if (frames == 0) {
      session = stamp + 1;
      if (auto done = recording.begin(input->cameras, stamp); !done) return done;
    }
    next.frame.session = session;
    if (auto done = recording.write(next.frame, stamp); !done) return done;
    progress.update(++frames, "");
  }
  return Error{"stopped by the user"};
}

int convert(const AppConfig& config, const ConvertArguments& arguments) {
  if (config.camera.path.empty()) return fail(kUsage, "nothing to convert: sovo convert IN -o OUT");
  if (arguments.ros_images && arguments.stereo_frames) {
    return fail(kUsage, "--ros-images and --stereo-frames exclude each other");
  }
  const auto sizes = bridge::read_sizes(config.record);
  if (!sizes) return fail(kUsage, sizes.error());
  if (!std::filesystem::exists(config.camera.path)) {
    return fail(kBadInput, config.camera.path + " does not exist");
  }
  StopSignal stop;  // before the threads of the source
  auto writer = RecordingWriter::create(config.record.out, sizes->file);
  if (!writer) return fail(kUsage, writer.error());
  const FrameForm form = arguments.ros_images      ? FrameForm::kRosImages
                         : arguments.stereo_frames ? FrameForm::kStereoFrames
                                                   : FrameForm::kAsRecorded;
  const bool recorded = recording_files(config.camera.path).ok();
  const auto done = recorded ? convert_recording(config, form, **writer, stop)
                             : convert_dataset(config, form, **writer, stop);
  const std::string out = config.record.out;
  if (!done) {
    (*writer).reset();
    std::filesystem::remove_all(out);  // made by this command a moment ago
    return fail(kBadInput, config.camera.path + ": " + done.error());
  }
  if (auto closed = (*writer)->close(); !closed) return fail(kFailed, closed.error());
  std::cout << out << ": " << (*writer)->messages() << " messages, " << (*writer)->bytes()
            << " bytes\n";
  return kOk;
}

}  // namespace

void add_convert_command(const Command& program) {
  const Command command = program.add_command(
      "convert", "Write a recording anew, or a dataset as a recording: form, compression, split");
  auto options = std::make_shared<ConfigOptions>(command);
  auto arguments = std::make_shared<ConvertArguments>();
  options->value("input", "camera.path", "Recording or dataset", "DIR|FILE")
      .value("-o,--out", "record.out", "Folder of the new recording, or one file", "DIR|X.mcap")
      .value("--compression", "record.compression", "Of the chunks", "none|lz4|zstd")
      .value("--split", "record.split", "Begin another file beyond this size", "SIZE")
      .value("--left", "node.left", "With --stereo-frames: image topic of the left camera", "TOPIC")
      .value("--right", "node.right", "That of the right camera", "TOPIC")
      .value("--calib", "camera.calibration", "Calibration file, instead of the recorded one",
             "FILE")
      .value("--ns", "dds.ns", "Namespace of new topics (default sovo)", "NAME");
  command.flag("--ros-images", "Stereo frames become Image and CameraInfo", &arguments->ros_images);
  command.flag("--stereo-frames", "The images of two cameras become stereo frames",
               &arguments->stereo_frames);
  command.action([options, arguments] {
    const auto config = options->load();
    return config ? convert(*config, *arguments) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
