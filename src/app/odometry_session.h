#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/app/profile_collector.h"
#include "sovo/app/run_outputs.h"
#include "sovo/app/run_recorder.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::app {

/// Gives everything to several sinks, in their order.
class TeeSink : public OutputSink {
 public:
  explicit TeeSink(std::vector<OutputSink*> sinks) : sinks_(std::move(sinks)) {}

  void on_frame(const OdometryOutput& output) override {
    for (OutputSink* sink : sinks_) sink->on_frame(output);
  }
  void on_keyframe(const KeyframeOutput& keyframe) override {
    for (OutputSink* sink : sinks_) sink->on_keyframe(keyframe);
  }
  void on_scale(const ScaleRecord& record) override {
    for (OutputSink* sink : sinks_) sink->on_scale(record);
  }

 private:
  std::vector<OutputSink*> sinks_;
};

/// An odometry with all that is recorded about it, from the first frame to the files at the end.
class OdometrySession {
 public:
  /// `publisher` gets the outputs too; may be null, must outlive the session. `profile` likewise,
  /// never null.
  OdometrySession(const AppConfig& config, const StereoCameras& cameras, ProfileCollector* profile,
                  OutputSink* publisher = nullptr);

  /// Live, frames that come faster than mapping goes are dropped and counted.
  void process(const StereoFrame& frame) { odometry_->process(frame); }
  /// Waits for mapping when its queue is nearly full, so that it drops nothing.
  void wait_for_mapping();
  void reset() { odometry_->reset(); }
  RunCounts counts() const { return recorder_.counts(); }

  /// Finishes the work, writes the files and prints the summary to stdout. Returns an exit code:
  /// the job has failed when no frame was tracked, or a file could not be written.
  int finish(const StampMap& original_stamp = {});

 private:
  AppConfig config_;
  ProfileCollector* profile_;
  RunRecorder recorder_;
  TeeSink sink_;
  std::unique_ptr<StereoOdometry> odometry_;
};

}  // namespace sovo::app
