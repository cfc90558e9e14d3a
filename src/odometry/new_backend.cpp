#include "sovo/odometry/new_backend.h"

#include <algorithm>

#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/features/feature_odometry.h"

namespace sovo {

namespace {

/// Halving averages the noise of four pixels, so that half the contrast is enough. A quarter is
/// not, in images halved twice: grey levels are whole numbers, and those maps broke at once.
DirectConfig for_halved(DirectConfig config, int halvings) {
  config.selection.least_offset /= 1 << std::min(halvings, 1);
  return config;
}

}  // namespace

std::unique_ptr<MonocularBackend> new_backend(const StereoOdometryConfig& config,
                                              const CameraModel& camera, const ImageU8& mask,
                                              int halvings, WorkerPool* pool,
                                              const LightObservers& light) {
  if (config.backend == Backend::kFeatures) {
    return std::make_unique<FeatureOdometry>(config.features, config.vo.keyframe, camera, mask,
                                             pool);
  }
  return std::make_unique<DirectOdometry>(for_halved(config.vo, halvings), camera, mask,
                                          config.seed, pool, light);
}

}  // namespace sovo
