#include "sovo/vo/map_history.h"

#include <cmath>

#include "sovo/geometry/pose_covariance.h"

namespace sovo {

void MapHistory::clear() {
  keyframes_.clear();
  covariance_.setZero();
}

void MapHistory::extend_covariance(const SE3& T_world_newest, const Mat6& step_covariance) {
  covariance_ +=
      carried(rotated(T_world_newest.rotation(), step_covariance), -T_world_newest.translation());
}

/// When the unit of the whole map changes. Later corrections are errors, which its sigma counts.
void MapHistory::rescale_covariance(double scale, const Vec3& centre) {
  covariance_ = carried(covariance_, centre);
  covariance_.topRows<3>() *= scale;
  covariance_.leftCols<3>() *= scale;
  covariance_ = carried(covariance_, -centre);
}

double MapHistory::still_to_apply(const ScaleCorrection& correction) const {
  return correction.log_scale - (log_scale() - epoch_log_scale_[correction.scale_epoch]);
}

void MapHistory::note_similarity(double log_scale, bool first_lock,
                                 const std::vector<WindowPose>& window) {
  const double sum = this->log_scale() + log_scale;
  epoch_log_scale_.push_back(sum);
  const double scale = std::exp(log_scale);
  if (first_lock) {
    const Vec3& centre = window.back().T_world_camera.translation();
    keyframes_.rescale_all(window, scale, centre, sum);
    rescale_covariance(scale, centre);
  } else {
    keyframes_.rescale(window, scale, sum);
  }
}

}  // namespace sovo
