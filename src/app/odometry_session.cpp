#include "sovo/app/odometry_session.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <iostream>

#include "sovo/app/exit_codes.h"

namespace sovo::app {
namespace {

/// Before the others; null ones are left out.
template <class T>
std::vector<T*> with(std::initializer_list<T*> own, std::vector<T*> others) {
  others.insert(others.begin(), own.begin(), own.end());
  std::erase(others, nullptr);
  return others;
}

/// As fast as can be, nothing is live: loops are closed as keyframes come.
std::unique_ptr<LoopSink> make_loops(const AppConfig& config, LoopSink::OnPlace on_place) {
  if (!config.loops.enabled) return nullptr;
  const StereoOdometryConfig& odometry = config.odometry;
  const bool live = !odometry.deterministic && !odometry.wait_for_mapping;
  return std::make_unique<LoopSink>(config.loops, odometry.matcher, live, std::move(on_place));
}

void tell_turn(const SO3& turn) {
  const Vec3 degrees = 180.0 / M_PI * turn.log();
  spdlog::warn(
      "the right camera is turned against its calibration by {:.3f}, {:.3f} and {:.3f} deg (pitch, "
      "yaw, roll), which was undone: calibrate again, or write a calibration that fits with "
      "--out-calib FILE",
      degrees.x(), degrees.y(), degrees.z());
}

void tell_focal_error(double error) {
  spdlog::warn(
      "the focal length is not as it was calibrated: keyframes see it {:.1f} % {}, which is a part "
      "of what it is off; find it with sovo calib refine",
      100.0 * std::abs(error), error > 0.0 ? "longer" : "shorter");
}

}  // namespace

OdometrySession::OdometrySession(const AppConfig& config, const StereoCameras& cameras,
                                 std::vector<OutputSink*> sinks,
                                 std::vector<StageObserver*> observers, LoopSink::OnPlace on_place)
    : config_(config),
      cameras_(cameras),
      recorder_({!config.output.live_trajectory.empty(), !config.output.keyframes.empty()}),
      loops_(make_loops(config, std::move(on_place))),
      sink_(with<OutputSink>({&recorder_, loops_.get()}, std::move(sinks))),
      observer_(with<StageObserver>({&profile_}, std::move(observers))) {
  begin();
}

void OdometrySession::begin() {
  odometry_ = std::make_unique<StereoOdometry>(config_.odometry, cameras_, &sink_, &observer_);
  if (loops_) loops_->begin(*odometry_);
}

void OdometrySession::restart() {
  odometry_->finish();
  odometry_.reset();
  recorder_.clear();
  begin();
}

int OdometrySession::finish(const StampMap& original_stamp) {
  odometry_->finish();
  RunResults results;
  results.refined = odometry_->refined_trajectory();
  if (loops_) {
    loops_->finish();
    results.loops = loops_->counts();
    results.corrected = loops_->corrected(results.refined);
    if (const std::uint64_t dropped = loops_->dropped(); dropped > 0) {
      spdlog::warn("{} keyframes were no places: loop closing had no time for them", dropped);
    }
  }
  results.recorder = &recorder_;
  results.profile = &profile_;
  const SO3 turn = odometry_->right_turn();
  results.rig = cameras_.rig.turned(turn);
  if (!turn.log().isZero(0.0)) tell_turn(turn);
  results.context.threads = config_.odometry.threads;
  results.original_stamp = original_stamp;
  const RunCounts counts = recorder_.counts();
  if (counts.focal_error != 0.0) tell_focal_error(counts.focal_error);
  std::cout << run_summary(profile_, counts, results.loops) << "\n"
            << timing_table(profile_) << std::flush;
  if (auto written = write_outputs(config_.output, results); !written) {
    spdlog::error("{}", written.error());
    return kFailed;
  }
  if (counts.tracked == 0) {
    spdlog::error("no frame was tracked{}", counts.fed == 0 ? ": none came" : "");
    return kFailed;
  }
  return kOk;
}

}  // namespace sovo::app
