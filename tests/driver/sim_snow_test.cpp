#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

/// Of which the second pair is looked at: flakes have moved then.
SimConfig with_snow(double snow, World world) {
  SimConfig config = clear_pictures(world, 2);
  config.snow = snow;
  return config;
}

/// Share of the pixels of `b` that are brighter than in `a` by more than `grey`.
double brighter(const SideImage& a, const SideImage& b, int grey) {
  int count = 0;
  for (std::size_t i = 0; i < a.data->size(); ++i) count += (*b.data)[i] > (*a.data)[i] + grey;
  return static_cast<double>(count) / static_cast<double>(a.data->size());
}

TEST(SimSnow, CoversTheMoreOfBothImagesTheMoreThereIs) {
  for (const World world : {World::kPool, World::kLawn}) {
    const StereoFrame none = last_pair(with_snow(0.0, world));
    const StereoFrame some = last_pair(with_snow(20.0, world));
    const StereoFrame much = last_pair(with_snow(100.0, world));
    const double once = brighter(none.left, some.left, 5);
    EXPECT_GT(once, 1e-4);
    EXPECT_NEAR(brighter(none.left, much.left, 5), 5.0 * once, 2.0 * once);
    EXPECT_NEAR(brighter(none.right, some.right, 5), once, 0.5 * once);
  }
}

TEST(SimSnow, FallsTheSameWayEachTime) {
  const SimConfig config = with_snow(20.0, World::kLawn);
  EXPECT_EQ(*last_pair(config).left.data, *last_pair(config).left.data);
  SimConfig other = config;
  other.seed = 2;
  EXPECT_NE(*last_pair(config).left.data, *last_pair(other).left.data);
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
