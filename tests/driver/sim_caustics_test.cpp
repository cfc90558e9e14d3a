#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <string>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

SimConfig with_caustics(double caustics, World world = World::kPool) {
  SimConfig config;
  config.world = world;
  config.caustics = caustics;
  config.frames = 1;
  config.sensor.auto_exposure = false;
  config.sensor.exposure_ms = 2.0;  // dark enough that no light is cut off
  config.sensor.read_noise = config.sensor.shot_noise = 0.0;
  return config;
}

StereoFrame seen(const SimConfig& config) {
  Calibration calibration;
  calibration.rig = vehicle_rig();
  SimSource source(config, calibration, own_motion(config.world));
  const SourceResult result = source.next(std::chrono::seconds(60));
  EXPECT_EQ(result.state, SourceState::kFrame) << result.message;
  return result.frame;
}

double mean_difference(const SideImage& a, const SideImage& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.data->size(); ++i) {
    sum += std::abs(static_cast<double>((*a.data)[i]) - static_cast<double>((*b.data)[i]));
  }
  return sum / static_cast<double>(a.data->size());
}

TEST(SimCaustics, AreAsStrongAsAskedForAndTheSameInBothImages) {
  const StereoFrame none = seen(with_caustics(0.0));
  const StereoFrame some = seen(with_caustics(1.0));
  const StereoFrame strong = seen(with_caustics(2.0));
  const double once = mean_difference(some.left, none.left);
  EXPECT_GT(once, 0.5);
  EXPECT_NEAR(mean_difference(strong.left, none.left), 2.0 * once, 0.2 * once);
  EXPECT_NEAR(mean_difference(some.right, none.right), once, 0.2 * once);
}

TEST(SimCaustics, AreNotSeenOnDryLand) {
  const StereoFrame none = seen(with_caustics(0.0, World::kLawn));
  const StereoFrame strong = seen(with_caustics(3.0, World::kLawn));
  EXPECT_EQ(*none.left.data, *strong.left.data);
}

TEST(SimCaustics, HaveLimits) {
  for (const double caustics : {-0.1, 5.1, std::nan("")}) {
    const auto source = open_sim(with_caustics(caustics));
    ASSERT_FALSE(source);
    EXPECT_NE(source.error().find("caustics must be in [0, 5]"), std::string::npos);
  }
}

}  // namespace
}  // namespace sovo::sim
