#include "sovo/app/odometry_session.h"

#include <spdlog/spdlog.h>

#include <iostream>

#include "sovo/app/exit_codes.h"

namespace sovo::app {
namespace {

template <class T>
std::vector<T*> with(T* own, std::vector<T*> others) {
  others.insert(others.begin(), own);
  return others;
}

}  // namespace

OdometrySession::OdometrySession(const AppConfig& config, const StereoCameras& cameras,
                                 std::vector<OutputSink*> sinks,
                                 std::vector<StageObserver*> observers)
    : config_(config),
      cameras_(cameras),
      recorder_({!config.output.live_trajectory.empty(), !config.output.keyframes.empty()}),
      sink_(with<OutputSink>(&recorder_, std::move(sinks))),
      observer_(with<StageObserver>(&profile_, std::move(observers))),
      odometry_(std::make_unique<StereoOdometry>(config.odometry, cameras, &sink_, &observer_)) {}

void OdometrySession::restart() {
  odometry_->finish();
  odometry_.reset();
  recorder_.clear();
  odometry_ = std::make_unique<StereoOdometry>(config_.odometry, cameras_, &sink_, &observer_);
}

int OdometrySession::finish(const StampMap& original_stamp) {
  odometry_->finish();
  RunResults results;
  results.refined = odometry_->refined_trajectory();
  results.recorder = &recorder_;
  results.profile = &profile_;
  results.context.threads = config_.odometry.threads;
  results.original_stamp = original_stamp;
  const RunCounts counts = recorder_.counts();
  std::cout << run_summary(profile_, counts) << "\n" << timing_table(profile_) << std::flush;
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
