#include "sovo/odometry/frame_verdict.h"

#include <cmath>

namespace sovo {

namespace {

/// With fewer inliers tracking is DEGRADED: of poses that are wrong most, of right ones hardly any.
double degraded_inliers(Backend backend) { return backend == Backend::kDirect ? 0.65 : 0.5; }

/// And with a larger standard deviation of where a frame is by itself [mean depths]. Of recorded
/// and rendered flights, open highways among them, hardly any frame comes to a third of it.
constexpr double kDegradedSigma = 0.004;

const char* compared_by(Backend backend) {
  return backend == Backend::kDirect ? "pixels" : "features";
}

/// Only a scale that was sought and not found for long is unobserved: standing still makes no
/// keyframes and loses no scale.
bool scale_is_old(const StereoOdometryConfig& config, const OdometryOutput& out) {
  return out.scale_age_s > config.scale_timeout_s && out.scale_verdict != ScaleVerdict::kAccepted;
}

std::string why_degraded(const StereoOdometryConfig& config, const FrameTracking& tracking,
                         double sigma, double focal_error, const std::string& right_problem) {
  if (!right_problem.empty()) return right_problem + "; the scale is not measured";
  if (tracking.good && tracking.inlier_ratio < degraded_inliers(config.backend)) {
    return "only " + std::to_string(static_cast<int>(100.0 * tracking.inlier_ratio)) +
           " % of the " + compared_by(config.backend) + " agree";
  }
  if (tracking.rest_denied) {
    return "the camera seems to stand, but much of the image moves: where it sees the vehicle "
           "itself, hide that with a mask";
  }
  if (tracking.motion_denied) {
    return "the camera seems to move, but much of the image stays in its place: where it sees the "
           "vehicle itself, hide that with a mask";
  }
  if (!(sigma <= kDegradedSigma)) return "the image tells too little of where the camera is";
  // Ways are too long or too short by more than any covariance says.
  if (focal_error != 0.0) {
    return "the focal length is not as it was calibrated: find it with sovo calib refine";
  }
  return "";
}

}  // namespace

void judge_frame(const StereoOdometryConfig& config, const FrameTracking& tracking, double mean_rho,
                 const std::string& right_problem, OdometryOutput* out) {
  const double sigma = mean_rho * std::sqrt(out->frame_covariance.topLeftCorner<3, 3>().trace());
  const bool scaled = config.mode != OdometryMode::kMono;
  out->state = OdometryState::kTracking;
  out->reason = why_degraded(config, tracking, sigma, out->focal_error, right_problem);
  if (!out->reason.empty()) {
    out->state = OdometryState::kDegraded;
  } else if (scaled && (!out->scale_valid || scale_is_old(config, *out))) {
    out->state = OdometryState::kScaleUnobserved;
    out->reason = "scale not measured: " + to_string(out->scale_verdict);
  } else if (out->decalibrated) {
    out->reason =
        "the right camera is turned against its calibration, which is undone: calibrate again";
  }
}

}  // namespace sovo
