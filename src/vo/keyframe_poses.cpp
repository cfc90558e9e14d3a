#include "sovo/vo/keyframe_poses.h"

#include <cstddef>

namespace sovo {

void KeyframePoses::record(const std::vector<WindowPose>& window, double log_scale) {
  for (std::size_t i = 0; i < window.size(); ++i) {
    const WindowPose& k = window[i];
    const bool is_new = poses_.size() <= k.id;
    if (is_new) poses_.resize(k.id + std::size_t{1});
    KeyframePose& pose = poses_[k.id];
    pose.id = k.id;
    if (is_new) pose.log_scale = log_scale;
    pose.stamp_ns = k.stamp_ns;
    pose.T_world_camera = k.T_world_camera;
    const bool beside_its_previous = i > 0 && window[i - 1].id + 1 == k.id;
    if (k.id == 0) {
      if (is_new) pose.step = pose.T_world_camera.translation();
    } else if (is_new || beside_its_previous) {
      const SE3& T_world_previous = poses_[k.id - std::size_t{1}].T_world_camera;
      pose.step =
          (T_world_previous.inverse() * pose.T_world_camera).translation() / pose.later_scale;
    }
  }
}

void KeyframePoses::rescale(const std::vector<WindowPose>& window, double scale, double log_scale) {
  for (std::size_t i = 0; i + 1 < window.size(); ++i) poses_[window[i].id].later_scale *= scale;
  poses_[window.back().id].log_scale = log_scale;
  record(window, log_scale);
}

void KeyframePoses::rescale_all(const std::vector<WindowPose>& window, double scale,
                                const Vec3& centre, double log_scale) {
  for (KeyframePose& pose : poses_) {
    Vec3& position = pose.T_world_camera.translation();
    position = centre + scale * (position - centre);
    pose.step = pose.id == 0 ? Vec3(centre + scale * (pose.step - centre)) : scale * pose.step;
    pose.log_scale = log_scale;
  }
  record(window, log_scale);
}

}  // namespace sovo
