#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/app/loop_sink.h"
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

/// Gives every time to several observers.
class TeeObserver : public StageObserver {
 public:
  explicit TeeObserver(std::vector<StageObserver*> observers) : observers_(std::move(observers)) {}

  void on_stage(Stage stage, double seconds) override {
    for (StageObserver* observer : observers_) observer->on_stage(stage, seconds);
  }
  void on_window(std::uint32_t points, std::uint32_t residuals) override {
    for (StageObserver* observer : observers_) observer->on_window(points, residuals);
  }

 private:
  std::vector<StageObserver*> observers_;
};

/// An odometry with all that is recorded about it, from the first frame to the files at the end.
class OdometrySession {
 public:
  /// `sinks` and `observers` get outputs and times too, and `on_place` the map of loop closing
  /// (LoopSink), where that is enabled; they must outlive the session.
  OdometrySession(const AppConfig& config, const StereoCameras& cameras,
                  std::vector<OutputSink*> sinks = {}, std::vector<StageObserver*> observers = {},
                  LoopSink::OnPlace on_place = {});

  /// Live, frames that come faster than mapping goes are dropped and counted.
  void process(const StereoFrame& frame) { odometry_->process(frame); }
  /// Begins a new segment with the next frame.
  void reset() { odometry_->reset(); }
  /// Begins anew with a source whose stamps have nothing to do with those before; what was
  /// recorded is forgotten.
  void restart();
  /// The undistorted camera that keyframes' points belong to.
  const CameraModel& tracked_camera() const { return odometry_->tracked_camera(); }
  RunCounts counts() const { return recorder_.counts(); }
  /// Null where loops are not closed.
  const LoopSink* loops() const { return loops_.get(); }

  /// Finishes the work, writes the files and prints the summary to stdout. Returns an exit code:
  /// the job has failed when no frame was tracked, or a file could not be written.
  int finish(const StampMap& original_stamp = {});

 private:
  void begin();

  AppConfig config_;
  StereoCameras cameras_;
  ProfileCollector profile_;
  RunRecorder recorder_;
  std::unique_ptr<LoopSink> loops_;  ///< Null: loops are not closed.
  TeeSink sink_;
  TeeObserver observer_;
  std::unique_ptr<StereoOdometry> odometry_;
};

}  // namespace sovo::app
