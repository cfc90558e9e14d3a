#include "sovo/odometry/trajectory_recorder.h"

#include <cmath>

namespace sovo {

std::vector<SE3> refined_keyframe_poses(const std::vector<KeyframePose>& keyframes) {
  std::vector<SE3> poses;
  refine_keyframe_poses(keyframes, 0, &poses);
  return poses;
}

void refine_keyframe_poses(const std::vector<KeyframePose>& keyframes, std::size_t first,
                           std::vector<SE3>* poses) {
  poses->resize(keyframes.size());
  for (std::size_t i = first; i < keyframes.size(); ++i) {
    const KeyframePose& k = keyframes[i];
    const Vec3 position = i == 0 ? k.step : (*poses)[i - 1] * k.step;
    (*poses)[i] = SE3(k.T_world_camera.rotation(), position);
  }
}

void TrajectoryRecorder::add(const TrackedFrame& tracked) {
  frames_.push_back({tracked.frame.stamp_ns, tracked.reference->keyframe_id,
                     tracked.tracking.T_current_reference, tracked.reference->log_scale});
}

void TrajectoryRecorder::compose(const std::vector<KeyframePose>& keyframes,
                                 std::vector<TrajectoryPose>* out) const {
  const std::vector<SE3> poses = refined_keyframe_poses(keyframes);
  // A frame that was tracked in the segment before, too, counts where it begins this one.
  if (!out->empty() && !frames_.empty() && out->back().stamp_ns == frames_.front().stamp_ns) {
    out->pop_back();
  }
  // A frame that became a keyframe has the keyframe's pose.
  std::size_t next = 0;
  for (const FrameRecord& f : frames_) {
    while (next < keyframes.size() && keyframes[next].stamp_ns < f.stamp_ns) ++next;
    if (next < keyframes.size() && keyframes[next].stamp_ns == f.stamp_ns) {
      out->push_back({f.stamp_ns, poses[next]});
      continue;
    }
    if (f.keyframe_id >= keyframes.size()) continue;
    SE3 T = f.T_left_keyframe;
    T.translation() *= std::exp(keyframes[f.keyframe_id].log_scale - f.log_scale);
    out->push_back({f.stamp_ns, poses[f.keyframe_id] * T.inverse()});
  }
}

void TrajectoryRecorder::close_segment(const std::vector<KeyframePose>& keyframes) {
  compose(keyframes, &closed_);
  frames_.clear();
}

std::vector<TrajectoryPose> TrajectoryRecorder::trajectory(
    const std::vector<KeyframePose>* keyframes) const {
  std::vector<TrajectoryPose> out = closed_;
  if (keyframes != nullptr) compose(*keyframes, &out);
  return out;
}

}  // namespace sovo
