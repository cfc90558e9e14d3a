#include "sovo/app/calib_refine.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <future>
#include <iostream>
#include <memory>
#include <utility>

#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/lens_refinement.h"
#include "sovo/app/mcap_input.h"
#include "sovo/app/run_outputs.h"
#include "sovo/app/stop_signal.h"
#include "sovo/io/calibration.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

struct RefineOptions {
  std::string out;
  int passes = 12;
};

/// Keeps what keyframes tell of the lens.
class LensCollector : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override { tracked_ |= output.pose_valid; }
  void on_keyframe(const KeyframeOutput& keyframe) override {
    if (keyframe.lens) evidence_.push_back(*keyframe.lens);
  }
  void on_scale(const ScaleRecord&) override {}

  const std::vector<LensEvidence>& evidence() const { return evidence_; }
  bool tracked() const { return tracked_; }

 private:
  std::vector<LensEvidence> evidence_;
  bool tracked_ = false;
};

Result<FrameInput> open_input(const AppConfig& config) {
  return config.camera.mcap.empty() ? open_dataset_input(config.camera, 0.0)
                                    : open_mcap_input(config);
}

/// Left for right: the odometry follows the other camera.
StereoCameras exchanged(StereoCameras cameras) {
  std::swap(cameras.rig.left, cameras.rig.right);
  cameras.rig.T_right_left = cameras.rig.T_right_left.inverse();
  std::swap(cameras.left_photometric, cameras.right_photometric);
  std::swap(cameras.left_mask, cameras.right_mask);
  return cameras;
}

StereoFrame exchanged(StereoFrame frame) {
  std::swap(frame.left, frame.right);
  const std::int64_t later = frame.left.stamp_offset_ns;
  frame.stamp_ns += later;
  frame.left.stamp_offset_ns -= later;
  frame.right.stamp_offset_ns -= later;
  return frame;
}

Result<std::unique_ptr<LensCollector>> run_direction(const AppConfig& config, const StereoRig& rig,
                                                     LensSide followed,
                                                     const std::atomic<bool>& stop) {
  auto input = open_input(config);
  if (!input) return input.failure();
  const bool right = followed == LensSide::kRight;
  StereoCameras cameras = input->cameras;
  cameras.rig = rig;
  if (right) cameras = exchanged(std::move(cameras));
  auto seen = std::make_unique<LensCollector>();
  StereoOdometry odometry(config.odometry, cameras, seen.get());
  if (auto begun = input->begin(); !begun) return begun.failure();
  while (!stop) {
    const SourceResult next = input->source->next(std::chrono::milliseconds(100));
    if (next.state == SourceState::kFailed) return Error{next.message};
    if (next.state == SourceState::kEndOfStream) break;
    if (next.state != SourceState::kFrame) continue;
    odometry.process(right ? exchanged(next.frame) : next.frame);
  }
  odometry.finish();
  return seen;
}

/// Forward and, of a dataset, backwards, at the same time.
Result<LensPass> run_pass(const AppConfig& config, const StereoRig& rig, LensSide followed,
                          StopSignal* stop) {
  std::atomic<bool> stopped = false;
  std::vector<std::future<Result<std::unique_ptr<LensCollector>>>> directions;
  for (const bool reverse : {false, true}) {
    if (reverse && !config.camera.mcap.empty()) continue;
    AppConfig directed = config;
    directed.camera.reverse = reverse;
    directions.push_back(std::async(std::launch::async, [directed, &rig, followed, &stopped] {
      return run_direction(directed, rig, followed, stopped);
    }));
  }
  LensPass out;
  std::vector<LensEvidence> evidence;
  bool tracked = false;
  Result<void> done;
  for (auto& direction : directions) {
    while (direction.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      stopped = stopped || stop->requested();
    }
    const auto run = direction.get();
    if (!run) {
      done = run.failure();
      continue;
    }
    const LensCollector& seen = **run;
    evidence.insert(evidence.end(), seen.evidence().begin(), seen.evidence().end());
    tracked |= seen.tracked();
  }
  if (!done) return done.failure();
  if (stopped) return Error{"stopped by the user; nothing was written"};
  if (!tracked) return Error{"no frame was tracked: a lens that is known roughly is needed"};
  out.fit = fit_lens(evidence);
  return out;
}

std::string percent(double v) { return format_fixed(100.0 * v, 2) + " %"; }

std::string in_words(const LensChange& change) {
  return "focal length " + std::string(change.focal < 0.0 ? "" : "+") + percent(change.focal) +
         ", radial distortion " + (change.radial < 0.0 ? "" : "+") + format_fixed(change.radial, 4);
}

void tell_pass(int number, const LensChange& with, const LensFit& seen) {
  std::cout << "pass " << number << ": " << in_words(with) << "; keyframes see "
            << in_words(seen.change) << " beyond it\n"
            << std::flush;
}

std::string why_not(const LensRefinement& found) {
  if (found.end == LensSearch::kUntold) {
    return "this recording does not tell the lens; turn the cameras about all of their axes while "
           "they move past near and far things, for half a minute and more";
  }
  return "after " + std::to_string(found.passes) +
         " passes keyframes still see another lens; give more with --passes, begin with a "
         "calibration that is nearer, or record more turns";
}

void report(const std::string& side, const LensRefinement& found, const CameraModel& given,
            const CameraModel& refined) {
  std::cout << side << ": fx " << format_fixed(given.fx, 3) << " -> " << format_fixed(refined.fx, 3)
            << " px (" << percent(std::log(refined.fx / given.fx)) << " +- "
            << percent(found.sigma.focal) << "), first coefficient " << format_fixed(given.d[0], 5)
            << " -> " << format_fixed(refined.d[0], 5) << " (+- "
            << format_fixed(found.sigma.radial, 5) << ")\n"
            << std::flush;
}

int refine(AppConfig config, const RefineOptions& options) {
  if (config.camera.mcap.empty() == config.camera.path.empty()) {
    return fail(kUsage, "give a recording: either --dataset FOLDER or --mcap RECORDING");
  }
  if (config.odometry.backend != Backend::kDirect) {
    return fail(kUsage, "the lens is refined with backend: direct");
  }
  OutputSection output;
  output.calibration = options.out;
  if (auto writable = check_outputs(output); !writable) return fail(kUsage, writable.error());
  StopSignal stop;
  config.camera.rate = "max";
  config.odometry.mode = OdometryMode::kScale;
  config.odometry.deterministic = true;
  config.odometry.threads = 1;
  config.odometry.vo.window.lens_every = 1;
  const auto input = open_input(config);
  if (!input) return fail(kBadInput, input.error());
  const StereoRig given = input->cameras.rig;
  spdlog::set_level(std::max(spdlog::get_level(), spdlog::level::warn));  // each pass opens it anew
  const RunLensPass run = [&](const StereoRig& rig, LensSide followed) {
    return run_pass(config, rig, followed, &stop);
  };
  const auto left = refine_lens(given, LensSide::kLeft, options.passes, run, tell_pass);
  if (!left) return fail(kFailed, left.error());
  if (left->end != LensSearch::kSettled) return fail(kFailed, why_not(*left));
  report("left", *left, given.left, left->rig.left);
  const auto right = refine_lens(left->rig, LensSide::kRight, options.passes, run, tell_pass);
  if (!right) return fail(kFailed, right.error());
  if (right->end == LensSearch::kOutOfPasses) return fail(kFailed, why_not(*right));
  StereoRig refined = left->rig;
  if (right->end == LensSearch::kSettled) {
    refined = right->rig;
    report("right", *right, given.right, refined.right);
  } else {
    std::cout << "right: changed as the left one is; the recording does not tell them apart\n";
  }
  const auto written = write_text_file(options.out, format_sovo_calibration(refined));
  return written ? kOk : fail(kFailed, written.error());
}

}  // namespace

void add_calib_refine_command(const Command& calib) {
  const Command command = calib.add_command(
      "refine", "Find focal length and radial distortion that fit a recording, from its motion");
  auto refining = std::make_shared<RefineOptions>();
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("--dataset", "camera.path", "Folder of the dataset", "DIR")
      .value("--mcap", "camera.mcap", "Recording: an .mcap file or a folder", "FILE|DIR")
      .value("--left", "node.left", "With --mcap: image topic of the left camera", "TOPIC")
      .value("--right", "node.right", "With --mcap: that of the right camera", "TOPIC")
      .value("--calib", "camera.calibration", "Calibration to begin with, instead of its own",
             "FILE")
      .value("--start", "camera.start", "Frames left out at the beginning", "N")
      .value("--frames", "camera.frames", "Frames at most", "N");
  command.option("--out", "Where the refined calibration is written", &refining->out)
      .required()
      .type("FILE");
  command.option("--passes", "How often the recording is gone through at most", &refining->passes)
      .in_range(1, 100)
      .show_default();
  command.action([options, refining] {
    const auto config = options->load();
    return config ? refine(*config, *refining) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
