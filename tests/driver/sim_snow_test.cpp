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

SimConfig with_snow(double snow, World world) {
  SimConfig config;
  config.world = world;
  config.snow = snow;
  config.frames = 2;
  config.sensor.auto_exposure = false;
  config.sensor.exposure_ms = 2.0;
  config.sensor.read_noise = config.sensor.shot_noise = 0.0;
  return config;
}

/// The second pair, after a frame's time.
StereoFrame second_pair(const SimConfig& config) {
  Calibration calibration;
  calibration.rig = vehicle_rig();
  SimSource source(config, calibration, own_motion(config.world));
  source.next(std::chrono::seconds(60));
  const SourceResult result = source.next(std::chrono::seconds(60));
  EXPECT_EQ(result.state, SourceState::kFrame) << result.message;
  return result.frame;
}

/// Share of the pixels of `b` that are brighter than in `a` by more than `grey`.
double brighter(const SideImage& a, const SideImage& b, int grey) {
  int count = 0;
  for (std::size_t i = 0; i < a.data->size(); ++i) count += (*b.data)[i] > (*a.data)[i] + grey;
  return static_cast<double>(count) / static_cast<double>(a.data->size());
}

TEST(SimSnow, CoversTheMoreOfBothImagesTheMoreThereIs) {
  for (const World world : {World::kPool, World::kLawn}) {
    const StereoFrame none = second_pair(with_snow(0.0, world));
    const StereoFrame some = second_pair(with_snow(20.0, world));
    const StereoFrame much = second_pair(with_snow(100.0, world));
    const double once = brighter(none.left, some.left, 5);
    EXPECT_GT(once, 1e-4);
    EXPECT_NEAR(brighter(none.left, much.left, 5), 5.0 * once, 2.0 * once);
    EXPECT_NEAR(brighter(none.right, some.right, 5), once, 0.5 * once);
  }
}

TEST(SimSnow, FallsTheSameWayEachTime) {
  const SimConfig config = with_snow(20.0, World::kLawn);
  EXPECT_EQ(*second_pair(config).left.data, *second_pair(config).left.data);
  SimConfig other = config;
  other.seed = 2;
  EXPECT_NE(*second_pair(config).left.data, *second_pair(other).left.data);
}

TEST(SimSnow, HasLimits) {
  for (const double snow : {-0.1, 1001.0, std::nan("")}) {
    const auto source = open_sim(with_snow(snow, World::kPool));
    ASSERT_FALSE(source);
    EXPECT_NE(source.error().find("snow must be in [0, 1000]"), std::string::npos);
  }
}

}  // namespace
}  // namespace sovo::sim
