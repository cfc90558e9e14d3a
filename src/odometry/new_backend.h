#pragma once

#include <memory>

#include "sovo/odometry/stereo_odometry.h"
#include "sovo/vo/light_observers.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// The monocular odometry that a configuration names. `camera`: pinhole, of images that are halved
/// `halvings` times. `mask`: 0 where they must not be used; may be empty.
std::unique_ptr<MonocularBackend> new_backend(const StereoOdometryConfig& config,
                                              const CameraModel& camera, const ImageU8& mask,
                                              int halvings, WorkerPool* pool,
                                              const LightObservers& light);

}  // namespace sovo
