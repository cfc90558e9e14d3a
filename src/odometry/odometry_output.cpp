#include "sovo/odometry/odometry_output.h"

namespace sovo {

OdometryOutput output_for(const StereoFrame& frame) {
  OdometryOutput out;
  out.stamp_ns = frame.stamp_ns;
  out.session = frame.session;
  out.sequence = frame.sequence;
  out.sync_error_s = frame.pair_error_s;
  return out;
}

std::string to_string(OdometryState state) {
  switch (state) {
    case OdometryState::kInitializing:
      return "INITIALIZING";
    case OdometryState::kTracking:
      return "TRACKING";
    case OdometryState::kScaleUnobserved:
      return "SCALE_UNOBSERVED";
    case OdometryState::kDegraded:
      return "DEGRADED";
    case OdometryState::kLost:
      return "LOST";
    case OdometryState::kResetting:
      return "RESETTING";
    case OdometryState::kStopped:
      break;
  }
  return "STOPPED";
}

std::string to_string(Stage stage) {
  switch (stage) {
    case Stage::kFrame:
      return "frame";
    case Stage::kUndistortion:
      return "undistortion";
    case Stage::kPyramid:
      return "pyramid";
    case Stage::kTracking:
      return "tracking";
    case Stage::kTracing:
      return "tracing";
    case Stage::kSelection:
      return "selection";
    case Stage::kStaticMatching:
      return "static_matching";
    case Stage::kBundleAdjustment:
      return "bundle_adjustment";
    case Stage::kMarginalization:
      return "marginalization";
    case Stage::kScaleOptimization:
      return "scale_optimization";
    case Stage::kCount:
      break;
  }
  return "unknown";
}

}  // namespace sovo
