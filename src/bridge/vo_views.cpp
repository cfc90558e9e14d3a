#include "sovo/bridge/vo_views.h"

#include <utility>

#include "sovo/bridge/borrow.h"
#include "sovo/bridge/diagnostics.h"
#include "sovo/bridge/point_conversion.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using namespace std::chrono_literals;

constexpr auto kStale = 3s;

}  // namespace

struct VoViews::Writers {
  Writer<msg::TrackedPoints> tracked_points;
  Writer<msg::PointCloud2> points;
  Writer<msg::DiagnosticArray> diagnostics;
};

VoViews::VoViews() : tracked_pace_(200ms), diagnostics_pace_(1s) {}
VoViews::~VoViews() = default;

Result<std::unique_ptr<VoViews>> VoViews::open(const Participant& participant,
                                               const OdometryFrames& frames, const SE3& T_base_left,
                                               bool publish_points) {
  auto tracked_points = Writer<msg::TrackedPoints>::open(participant, topics::kTrackedPoints,
                                                         topics::kTrackedPointsQos);
  if (!tracked_points) return tracked_points.failure();
  auto points = Writer<msg::PointCloud2>::open(participant, topics::kPoints, topics::kPointsQos);
  if (!points) return points.failure();
  auto diagnostics = Writer<msg::DiagnosticArray>::open(participant, topics::kDiagnostics,
                                                        topics::kDiagnosticsQos);
  if (!diagnostics) return diagnostics.failure();
  std::unique_ptr<VoViews> views(new VoViews());
  views->writers_.reset(
      new Writers{std::move(*tracked_points), std::move(*points), std::move(*diagnostics)});
  views->frames_ = frames;
  views->process_name_ = participant.config().ns + ": visual odometry";
  views->T_base_left_ = T_base_left;
  views->publish_points_ = publish_points;
  views->newest_.output.reason = "no frame yet";
  views->worker_ =
      std::make_unique<BackgroundWorker>("sovo-views", 500ms, [raw = views.get()] { raw->work(); });
  return views;
}

void VoViews::set_cameras(const Cameras& cameras) {
  const std::lock_guard lock(mutex_);
  newest_.cameras = cameras;
}

void VoViews::offer(const OdometryOutput& output, const FeedStatus& feed) {
  {
    const std::lock_guard lock(mutex_);
    newest_.output = output;
    newest_.feed = feed;
    newest_.arrived = Pace::Clock::now();
  }
  worker_->wake();
}

void VoViews::offer(const KeyframeOutput& keyframe) {
  if (keyframe.revised) return;
  auto copy = std::make_shared<const KeyframeOutput>(keyframe);
  {
    const std::lock_guard lock(mutex_);
    newest_.keyframe = std::move(copy);
    newest_.keyframe_is_new = true;
  }
  worker_->wake();
}

void VoViews::check(const Result<void>& written) {
  if (!written) ++failed_;
}

void VoViews::work() {
  Newest newest;
  {
    const std::lock_guard lock(mutex_);
    newest = newest_;
    newest_.keyframe_is_new = false;
  }
  if (newest.keyframe_is_new) show_points(newest);
  show_tracked_points(newest);
  if (diagnostics_pace_.due()) show_diagnostics(newest);
}

void VoViews::show_points(const Newest& newest) {
  if (!publish_points_ || !newest.cameras || !newest.keyframe->scale_valid) return;
  if (writers_->points.num_readers() == 0) return;
  const PointCloudMessage cloud(*newest.keyframe, newest.cameras->tracked, T_base_left_, frames_);
  check(writers_->points.write(cloud.message()));
  ++made_;
}

void VoViews::show_tracked_points(const Newest& newest) {
  if (!newest.cameras || !newest.keyframe || newest.output.stamp_ns == shown_stamp_ns_) return;
  if (writers_->tracked_points.num_readers() == 0 || !tracked_pace_.due()) return;
  shown_stamp_ns_ = newest.output.stamp_ns;
  const PointsInView points = points_in_view(newest.output, *newest.keyframe,
                                             newest.cameras->tracked, newest.cameras->raw_left);
  msg::TrackedPoints m{};
  m.header = {to_message(newest.output.stamp_ns), borrow(newest.feed.camera_frame)};
  borrow(m.u, points.u);
  borrow(m.v, points.v);
  borrow(m.inverse_depth, points.inverse_depth);
  check(writers_->tracked_points.write(m));
  ++made_;
}

void VoViews::show_diagnostics(const Newest& newest) {
  const bool began = newest.arrived != Pace::Clock::time_point{};
  const bool stale = !began || Pace::Clock::now() - newest.arrived > kStale;
  DiagnosticReport report = describe(process_name_, newest.output, newest.feed, stale);
  report.values.emplace_back("views_failed", std::to_string(failed_));
  const DiagnosticsMessage message(std::move(report), dds_time());
  check(writers_->diagnostics.write(message.message()));
}

}  // namespace sovo::bridge
