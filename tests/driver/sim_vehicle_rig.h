#pragma once

#include <gtest/gtest.h>

#include <chrono>

#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"
#include "support/cameras.h"

namespace sovo::sim {

/// Two small cameras that look into different directions, on a vehicle with lamps or a shadow.
inline StereoRig vehicle_rig() {
  StereoRig rig;
  rig.left = test::make_camera(160, 112, 95, 95, 79.5, 55.5);
  rig.right = test::make_camera(160, 112, 96, 95, 81, 54);
  rig.T_right_left = SE3(SO3::exp({0.006, -0.3, 0.004}), Vec3(-0.2, 0.002, 0.003));
  return rig;
}

/// Without noise, and dark enough that no light is cut off.
inline SimConfig clear_pictures(World world, int frames) {
  SimConfig config;
  config.world = world;
  config.frames = frames;
  config.sensor.auto_exposure = false;
  config.sensor.exposure_ms = 2.0;
  config.sensor.read_noise = config.sensor.shot_noise = 0.0;
  return config;
}

/// The last pair that these cameras see of what is configured.
inline StereoFrame last_pair(const SimConfig& config) {
  Calibration calibration;
  calibration.rig = vehicle_rig();
  SimSource source(config, calibration, own_motion(config.world));
  SourceResult result;
  for (int i = 0; i < config.frames; ++i) result = source.next(std::chrono::seconds(60));
  EXPECT_EQ(result.state, SourceState::kFrame) << result.message;
  return result.frame;
}

}  // namespace sovo::sim
