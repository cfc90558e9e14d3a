#include "sovo/vo/features/feature_window.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sovo {

const Observation* FeatureLandmark::seen_in(std::uint32_t keyframe_id) const {
  const auto found =
      std::find_if(observations.rbegin(), observations.rend(),
                   [&](const Observation& o) { return o.keyframe_id == keyframe_id; });
  return found == observations.rend() ? nullptr : &*found;
}

int FeatureLandmark::num_inliers() const {
  return static_cast<int>(std::count_if(observations.begin(), observations.end(),
                                        [](const Observation& o) { return o.inlier; }));
}

double FeatureLandmark::sigma(double min_parallax) const {
  double known = information;
  if (static_sigma > 0.0 && parallax < min_parallax) known += 1.0 / (static_sigma * static_sigma);
  return known > 0.0 ? 1.0 / std::sqrt(known) : std::numeric_limits<double>::infinity();
}

double FeatureWindow::mean_inverse_depth() const {
  double sum = 0.0;
  int n = 0;
  for (const FeatureLandmark& l : landmarks) {
    if (!l.has_depth) continue;
    sum += l.rho;
    ++n;
  }
  return sum > 0.0 ? sum / n : 1.0;
}

int FeatureWindow::num_with_depth() const {
  return static_cast<int>(std::count_if(landmarks.begin(), landmarks.end(),
                                        [](const FeatureLandmark& l) { return l.has_depth; }));
}

std::vector<WindowPose> FeatureWindow::poses() const {
  std::vector<WindowPose> out;
  for (const FeatureKeyframe& k : keyframes) {
    out.push_back({k.id, k.stamp_ns, k.T_camera_world.inverse()});
  }
  return out;
}

void FeatureWindow::erase_marked() {
  std::erase_if(landmarks, [](const FeatureLandmark& l) { return l.remove; });
}

void FeatureWindow::drop_oldest() {
  const std::uint32_t id = keyframes.front().id;
  for (FeatureLandmark& l : landmarks) {
    l.remove = l.host_id == id;
    std::erase_if(l.observations, [&](const Observation& o) { return o.keyframe_id == id; });
  }
  erase_marked();
  keyframes.erase(keyframes.begin());
}

void FeatureWindow::apply_similarity(double scale) {
  const Vec3 centre = newest().T_camera_world.inverse().translation();
  for (FeatureKeyframe& k : keyframes) {
    SE3 T_world_camera = k.T_camera_world.inverse();
    T_world_camera.translation() = centre + scale * (T_world_camera.translation() - centre);
    k.T_camera_world = T_world_camera.inverse();
    k.shift.per_row *= scale;
  }
  for (FeatureLandmark& l : landmarks) {
    l.rho /= scale;
    l.static_sigma /= scale;
    l.information *= scale * scale;
  }
}

}  // namespace sovo
