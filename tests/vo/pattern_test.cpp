#include "sovo/vo/pattern.h"

#include <gtest/gtest.h>

#include <numeric>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// Waves in all directions, a few patterns long.
double waves(double u, double v) {
  return 125.0 + 40.0 * std::sin(0.21 * u + 0.05 * v) + 40.0 * std::sin(0.04 * u - 0.2 * v + 1.0) +
         40.0 * std::sin(0.13 * u + 0.15 * v + 2.0);
}

/// Two keyframes above the ground (camera y down), the second one behind the first, without noise.
class GroundBelow {
 public:
  GroundBelow() : window_(make_camera(320, 240, 260, 260, 159.5, 119.5)) {
    const CameraModel& c = window_.camera();
    const SE3 behind(SO3(), Vec3(0.0, 0.0, -kStep));
    ImageF host(c.width, c.height);
    ImageF target(c.width, c.height);
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        host.at(x, y) = static_cast<float>(waves(x, y));
        const double rho = ground(y);
        const double depth_ratio = 1.0 / (1.0 - kStep * std::max(rho, 0.0));
        target.at(x, y) = static_cast<float>(
            waves(c.cx + (x - c.cx) * depth_ratio, c.cy + (y - c.cy) * depth_ratio));
      }
    }
    window_.insert(make_keyframe(0, pyramid_of(std::move(host)), SE3()));
    window_.insert(make_keyframe(1, pyramid_of(std::move(target)), behind));
    window_.update_geometry();
  }

  /// Inverse depth of the ground in row v.
  double ground(double v) const {
    return (v - window_.camera().cy) / (kHeight * window_.camera().fy);
  }

  /// How many rows off the depth lies that fits the pattern around a pixel best.
  double rows_off(int u, int v) {
    Point p = make_point(window_[0].image(), u, v, ground(v));
    Residual residual;
    residual.state = ResidualState::kIn;
    for (int i = 0; i < 6; ++i) {
      LinearizedResidual r;
      linearize(window_, WindowConfig(), 0, 1, p, residual, &r);
      EXPECT_EQ(r.state, ResidualState::kIn);
      const DepthPart depth = depth_part(r);
      p.rho -= depth.gradient / depth.hessian;
    }
    return p.rho / ground(1.0 + window_.camera().cy) - (v - window_.camera().cy);
  }

 private:
  static constexpr double kHeight = 1.5;
  static constexpr double kStep = 0.4;
  Window window_;
};

TEST(Pattern, DepthOnASlopeIsThatOfThePointInItsMiddle) {
  GroundBelow ground;
  std::vector<double> off;
  for (int v = 160; v <= 210; v += 5) {
    for (int u = 60; u <= 260; u += 10) off.push_back(ground.rows_off(u, v));
  }
  const double mean =
      std::accumulate(off.begin(), off.end(), 0.0) / static_cast<double>(off.size());
  EXPECT_LT(std::abs(mean), 0.06) << "rows; 0.13 with the pattern of DSO";
}

}  // namespace
}  // namespace sovo
