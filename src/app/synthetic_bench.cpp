#include "sovo/app/synthetic_bench.h"

#include <chrono>
#include <cmath>
#include <map>
#include <utility>

#include "sovo/app/frame_input.h"
#include "sovo/app/profile_collector.h"
#include "sovo/app/sim_input.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"
#include "sovo/eval/evaluation.h"
#include "sovo/eval/nees.h"
#include "sovo/eval/relative_nees.h"

namespace sovo::app {
namespace {

/// What a run leaves for its evaluation.
class Recording : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override {
    ++frames_;
    tracked_ += output.pose_valid ? 1 : 0;
    if (output.pose_valid && output.scale_valid) {
      poses_.push_back({output.stamp_ns, output.segment, output.T_odom_left, output.pose_covariance,
                        output.frame_covariance});
    }
    if (!output.is_keyframe) return;
    ++keyframes_;
    if (output.scale_valid) sigmas_[output.stamp_ns] = output.log_scale_sigma;
  }
  void on_keyframe(const KeyframeOutput& /*keyframe*/) override {}
  void on_scale(const ScaleRecord& record) override {
    scales_.push_back({record.stamp_ns, record.measured, record.sigma, to_string(record.verdict)});
  }

  std::size_t frames() const { return frames_; }
  std::size_t tracked() const { return tracked_; }
  std::size_t keyframes() const { return keyframes_; }
  const std::vector<KeyframeRecord>& scales() const { return scales_; }
  /// Posterior sigma of the log scale at the keyframes, by stamp.
  const std::map<std::int64_t, double>& sigmas() const { return sigmas_; }
  const std::vector<UncertainPose>& poses() const { return poses_; }

 private:
  std::size_t frames_ = 0, tracked_ = 0, keyframes_ = 0;
  std::vector<KeyframeRecord> scales_;
  std::map<std::int64_t, double> sigmas_;
  std::vector<UncertainPose> poses_;
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

/// Consistency of the scale errors with the sigmas of the keyframes that they begin at.
double scale_nees(const EvaluationReport& report, const Trajectory& truth,
                  const std::map<std::int64_t, double>& sigmas) {
  std::vector<double> errors;
  std::vector<double> claimed;
  for (const ScaleSample& sample : report.scale_samples) {
    const auto stamp = truth.front().stamp_ns +
                       std::llround(1e9 * report.times[static_cast<std::size_t>(sample.first)]);
    const auto next = sigmas.lower_bound(stamp - 1'000'000);
    if (next == sigmas.end() || next->first > stamp + 1'000'000) continue;
    errors.push_back(sample.log_scale);
    claimed.push_back(next->second);
  }
  return nees_summary(errors, claimed).mean;
}

/// Displacement that tells the scale: as far as one sees the nearer points [m].
double scale_length(sim::World world) { return world == sim::World::kStreet ? 10.0 : 0.5; }

Result<SyntheticResult> measure(const Recording& recording, const Trajectory& truth,
                                const std::vector<TrajectoryPose>& refined,
                                const SyntheticCase& which, double frame_ms) {
  EvaluationInput input;
  input.truth = truth;
  for (const TrajectoryPose& pose : refined) {
    input.estimate.push_back({pose.stamp_ns, pose.T_odom_left});
  }
  input.keyframes = recording.scales();
  EvaluationOptions options;
  options.frames = recording.frames();
  options.scale_length = scale_length(which.world);
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
  result.scale_median = report->scale.median_abs;
  result.scale_p95 = report->scale.p95_abs;
  result.scale_nees = scale_nees(*report, truth, recording.sigmas());
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
  ProfileCollector profile;
  StereoOdometry odometry(c.odometry, to_cameras(source.calibration()), &recording, &profile);
  const std::size_t total = source.size().value_or(0);
  for (std::size_t done = 0;;) {
    const SourceResult next = source.next(std::chrono::seconds(60));
    if (next.state == SourceState::kEndOfStream) break;
    if (next.state != SourceState::kFrame) continue;
    odometry.process(next.frame);
    if (!progress(++done, total)) return Error{"stopped by the user"};
  }
  odometry.finish();
  const double frame_ms = profile.stages()[static_cast<std::size_t>(Stage::kFrame)].mean_ms;
  return measure(recording, source.truth(), odometry.refined_trajectory(), which, frame_ms);
}

}  // namespace sovo::app
