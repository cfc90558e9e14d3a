#include "support/sine_sum.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "support/synthetic_scene.h"

namespace sovo::test {
namespace {

TEST(SineSum, IsTheSumOfSines) {
  std::mt19937 random(5);
  SineSum sum;
  std::vector<std::array<double, 4>> waves(7);  // not a multiple of four
  for (auto& w : waves) {
    w = {uniform(random, -60.0, 60.0), uniform(random, -60.0, 60.0), uniform(random, 0.0, 6.3),
         uniform(random, 0.1, 1.0)};
    sum.add(w[0], w[1], w[2], 2.0 * w[3]);
  }
  sum.scale(0.5);
  for (int i = 0; i < 2000; ++i) {
    const double s = uniform(random, -9.0, 9.0);
    const double t = uniform(random, -9.0, 9.0);
    double expected = 0.0;
    for (const auto& w : waves) expected += w[3] * std::sin(w[0] * s + w[1] * t + w[2]);
    ASSERT_NEAR(sum(s, t), expected, 1e-14) << s << ", " << t;
  }
}

}  // namespace
}  // namespace sovo::test
