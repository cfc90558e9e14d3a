#include "sovo/vo/monocular_backend.h"

#include <cmath>

namespace sovo {

void rescale(double scale, ReferenceKeyframe* reference) {
  const Vec3 centre = reference->T_world_camera.translation();
  for (WindowPose& k : reference->keyframe_poses) {
    k.T_world_camera.translation() = centre + scale * (k.T_world_camera.translation() - centre);
  }
  reference->mean_rho /= scale;
  reference->log_scale += std::log(scale);
}

}  // namespace sovo
