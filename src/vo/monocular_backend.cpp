#include "sovo/vo/monocular_backend.h"

#include <cmath>

namespace sovo {

void rescale(double scale, ReferenceKeyframe* reference) {
  const Vec3 centre = reference->T_world_camera.translation();
  for (auto& [id, T] : reference->keyframe_poses) {
    T.translation() = centre + scale * (T.translation() - centre);
  }
  reference->mean_rho /= scale;
  reference->log_scale += std::log(scale);
}

}  // namespace sovo
