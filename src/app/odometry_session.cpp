#include "sovo/app/odometry_session.h"

#include <spdlog/spdlog.h>

#include <iostream>

#include "sovo/app/exit_codes.h"

namespace sovo::app {
namespace {

std::vector<OutputSink*> sinks(OutputSink* recorder, OutputSink* publisher) {
  if (publisher == nullptr) return {recorder};
  return {recorder, publisher};
}

}  // namespace

OdometrySession::OdometrySession(const AppConfig& config, const StereoCameras& cameras,
                                 ProfileCollector* profile, OutputSink* publisher)
    : config_(config),
      profile_(profile),
      recorder_({!config.output.live_trajectory.empty(), !config.output.keyframes.empty()}),
      sink_(sinks(&recorder_, publisher)),
      odometry_(std::make_unique<StereoOdometry>(config.odometry, cameras, &sink_, profile)) {}

void OdometrySession::wait_for_mapping() {
  const auto limit = static_cast<std::uint32_t>(config_.odometry.mapping_queue);
  if (recorder_.counts().queue_depth + 1 >= limit) odometry_->finish();
}

int OdometrySession::finish(const StampMap& original_stamp) {
  odometry_->finish();
  RunResults results;
  results.refined = odometry_->refined_trajectory();
  results.recorder = &recorder_;
  results.profile = profile_;
  results.context.threads = config_.odometry.threads;
  results.original_stamp = original_stamp;
  const RunCounts counts = recorder_.counts();
  std::cout << run_summary(*profile_, counts) << "\n" << timing_table(*profile_) << std::flush;
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
