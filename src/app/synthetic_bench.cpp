#include "sovo/app/synthetic_bench.h"

#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "sovo/app/depth_scale.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/profile_collector.h"
#include "sovo/app/sim_input.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"
#include "sovo/eval/evaluation.h"
#include "sovo/eval/nees.h"
#include "sovo/eval/relative_nees.h"
#include "sovo/eval/statistics.h"

namespace sovo::app {
namespace {

/// What a run leaves for its evaluation.
class Recording : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override {
    ++frames_;
    tracked_ += output.pose_valid ? 1 : 0;
    keyframes_ += output.is_keyframe ? 1 : 0;
    scale_sigma_.reset();
    if (!output.pose_valid || !output.scale_valid) return;
    scale_sigma_ = output.log_scale_sigma;
    poses_.push_back({output.stamp_ns, output.segment, output.T_odom_left, output.pose_covariance,
                      output.frame_covariance});
  }
  void on_keyframe(const KeyframeOutput& keyframe) override {
    if (!keyframe.revised && keyframe.scale_valid) keyframe_ = keyframe;
  }
  void on_scale(const ScaleRecord& record) override {
    scales_.push_back({record.stamp_ns, record.measured, record.sigma, to_string(record.verdict)});
    if (keyframe_ && keyframe_->id == record.keyframe_id) correction_ = record.correction;
  }

  std::size_t frames() const { return frames_; }
  std::size_t tracked() const { return tracked_; }
  std::size_t keyframes() const { return keyframes_; }
  const std::vector<KeyframeRecord>& scales() const { return scales_; }
  const std::vector<UncertainPose>& poses() const { return poses_; }
  /// Standard deviation of the log-scale that came with the newest frame.
  std::optional<double> scale_sigma() const { return scale_sigma_; }
  /// The newest keyframe, once.
  std::optional<KeyframeOutput> take_keyframe() { return std::exchange(keyframe_, std::nullopt); }
  /// What was applied to the log-scale since it was given out.
  double take_correction() { return std::exchange(correction_, 0.0); }

 private:
  std::size_t frames_ = 0, tracked_ = 0, keyframes_ = 0;
  std::vector<KeyframeRecord> scales_;
  std::vector<UncertainPose> poses_;
  std::optional<double> scale_sigma_;
  std::optional<KeyframeOutput> keyframe_;
  double correction_ = 0.0;
};

/// Errors of the scale at the keyframes, after its correction, and what the next frame claims of
/// them.
class ScaleErrors {
 public:
  /// After each frame of a deterministic run.
  void add(const CameraModel& tracked, Recording* recording, sim::SimSource* source) {
    if (newest_ && recording->scale_sigma()) {
      errors_.push_back(*newest_);
      magnitudes_.push_back(std::abs(*newest_));
      sigmas_.push_back(*recording->scale_sigma());
    }
    newest_.reset();
    const auto keyframe = recording->take_keyframe();
    const double correction = recording->take_correction();
    if (!keyframe) return;
    newest_ = depth_log_scale(*keyframe, tracked, source);
    if (newest_) *newest_ -= correction;
  }

  double magnitude(double share) const { return quantile(magnitudes_, share); }
  double nees() const { return nees_summary(errors_, sigmas_).mean; }

 private:
  std::optional<double> newest_;
  std::vector<double> errors_, magnitudes_, sigmas_;
};

AppConfig configured(const AppConfig& config, const SyntheticCase& which, std::uint64_t seed) {
  AppConfig c = config;
  c.sim.world = which.world;
  c.sim.trajectory = which.trajectory;
  c.sim.seed = seed;
  c.sim.threads = 1;  // the other core is the odometry's
  c.camera.reverse = which.reverse;
  c.odometry.deterministic = true;
  c.odometry.seed = static_cast<int>(seed);
  return c;
}

Result<SyntheticResult> measure(const Recording& recording, const ScaleErrors& scale,
                                const Trajectory& truth, const std::vector<TrajectoryPose>& refined,
                                double frame_ms) {
  EvaluationInput input;
  input.truth = truth;
  for (const TrajectoryPose& pose : refined) {
    input.estimate.push_back({pose.stamp_ns, pose.T_odom_left});
  }
  input.keyframes = recording.scales();
  EvaluationOptions options;
  options.frames = recording.frames();
  const auto report = evaluate(input, options);
  if (!report) return report.failure();
  SyntheticResult result;
  result.length_m = report->path_length;
  result.frames = recording.frames();
  const auto frames = static_cast<double>(recording.frames());
  result.completion = static_cast<double>(recording.tracked()) / frames;
  result.t_rel = report->overall.translation_mean;
  result.r_rel = report->overall.rotation_mean;
  result.ate_m = report->rigid.translation.rmse;
  result.scale_median = scale.magnitude(0.5);
  result.scale_p95 = scale.magnitude(0.95);
  result.scale_nees = scale.nees();
  result.pose_nees_1s = relative_nees(recording.poses(), truth, {.seconds = 1.0});
  result.pose_nees_10m = relative_nees(recording.poses(), truth, {.metres = 10.0});
  result.frame_ms = frame_ms;
  result.keyframes_per_frame = static_cast<double>(recording.keyframes()) / frames;
  return result;
}

}  // namespace

std::vector<SyntheticCase> all_synthetic_cases() {
  std::vector<SyntheticCase> cases;
  for (const auto& [world, name] : enum_names(sim::World{})) {
    for (const std::string& trajectory : sim::own_trajectories(world)) {
      for (const bool reverse : {false, true}) cases.push_back({world, trajectory, reverse});
    }
  }
  return cases;
}

std::string name_of(const SyntheticCase& which) {
  return std::string(sim::name_of(which.world)) + "/" + which.trajectory +
         (which.reverse ? " <" : "");
}

Result<SyntheticResult> run_synthetic(
    const AppConfig& config, const SyntheticCase& which, std::uint64_t seed,
    const std::function<bool(std::size_t, std::size_t)>& progress) {
  const AppConfig c = configured(config, which, seed);
  auto opened = sim::open_sim(sim_options(c, 0.0));
  if (!opened) return opened.failure();
  sim::SimSource& source = **opened;
  Recording recording;
  ScaleErrors scale;
  ProfileCollector profile;
  StereoOdometry odometry(c.odometry, to_cameras(source.calibration()), &recording, &profile);
  const std::size_t total = source.size().value_or(0);
  for (std::size_t done = 0;;) {
    const SourceResult next = source.next(std::chrono::seconds(60));
    if (next.state == SourceState::kEndOfStream) break;
    if (next.state != SourceState::kFrame) continue;
    odometry.process(next.frame);
    scale.add(odometry.tracked_camera(), &recording, &source);
    if (!progress(++done, total)) return Error{"stopped by the user"};
  }
  odometry.finish();
  const double frame_ms = profile.stages()[static_cast<std::size_t>(Stage::kFrame)].mean_ms;
  return measure(recording, scale, source.truth(), odometry.refined_trajectory(), frame_ms);
}

}  // namespace sovo::app
