#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/sim_source.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

SimConfig with_caustics(double caustics, World world = World::kPool) {
  SimConfig config = clear_pictures(world, 1);
  config.caustics = caustics;
  return config;
}

double mean_difference(const SideImage& a, const SideImage& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.data->size(); ++i) {
    sum += std::abs(static_cast<double>((*a.data)[i]) - static_cast<double>((*b.data)[i]));
  }
  return sum / static_cast<double>(a.data->size());
}

TEST(SimCaustics, AreAsStrongAsAskedForAndTheSameInBothImages) {
  const StereoFrame none = last_pair(with_caustics(0.0));
  const StereoFrame some = last_pair(with_caustics(1.0));
  const StereoFrame strong = last_pair(with_caustics(2.0));
  const double once = mean_difference(some.left, none.left);
  EXPECT_GT(once, 0.5);
  EXPECT_NEAR(mean_difference(strong.left, none.left), 2.0 * once, 0.2 * once);
  EXPECT_NEAR(mean_difference(some.right, none.right), once, 0.2 * once);
}

TEST(SimCaustics, AreNotSeenOnDryLand) {
  const StereoFrame none = last_pair(with_caustics(0.0, World::kLawn));
  const StereoFrame strong = last_pair(with_caustics(3.0, World::kLawn));
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
