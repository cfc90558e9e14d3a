#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sovo/vo/linearization.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

struct Change {
  double size = 1.0, roll = 0.0, shift = 0.0;
};

/// A camera that looks along its path at walls that face it: what a keyframe sees, the other sees
/// around the same middle, `size` times as large, turned by `roll` and `shift` pixels to the right.
class OtherSizes : public ::testing::Test {
 protected:
  static constexpr double kPointSpread = 0.5;  // [px]
  static constexpr double kMiddleU = 158.7, kMiddleV = 121.3;

  OtherSizes() : camera_(make_camera(320, 240, 260, 260, kMiddleU, kMiddleV)) {}

  /// `shown`: grey level at a place of the host's image, from its middle, through a lens that
  /// blurs by this much [px of the host].
  template <class Shown>
  Window window(const Change& change, const Shown& shown) const {
    Window window(camera_);
    const SO3 turn = SO3::exp(Vec3(0.0, 0.0, change.roll));
    const auto image = [&](double size, const SO3& turned, double shift) {
      ImageF out(camera_.width, camera_.height);
      for (int y = 0; y < out.height(); ++y) {
        for (int x = 0; x < out.width(); ++x) {
          const Vec3 at = turned.inverse() * Vec3(x - kMiddleU - shift, y - kMiddleV, 0.0) / size;
          out.at(x, y) = static_cast<float>(shown(at.x(), at.y(), kPointSpread / size));
        }
      }
      return pyramid_of(std::move(out));
    };
    window.insert(make_keyframe(0, image(1.0, SO3(), 0.0), SE3()));
    // T_camera_world: what is a unit away is 1 / size away.
    const double aside = change.shift / (change.size * camera_.fx);
    const SE3 T_target_host(turn, Vec3(aside, 0.0, 1.0 / change.size - 1.0));
    window.insert(
        make_keyframe(1, image(change.size, turn, change.shift), T_target_host.inverse()));
    window.update_geometry();
    return window;
  }

  LinearizedResidual residual(const Window& window, int u, int v, bool equal_blur) const {
    WindowConfig config;
    config.equal_blur = equal_blur;
    config.point_spread_px = kPointSpread;
    config.huber = 1000.0;
    LinearizedResidual r;
    linearize(window, config, 0, 1, make_point(window[0].image(), u, v, 1.0),
              {.state = ResidualState::kIn}, &r);
    return r;
  }

  CameraModel camera_;
};

/// Waves with periods of 6 to 9 px in both directions, seen through a lens.
double lens_waves(double x, double y, double blur) {
  double grey = 120.0;
  const Vec2 at(x, y);
  for (const Vec2& k : {Vec2(1.0, 0.2), Vec2(-0.3, 0.9), Vec2(0.5, -0.5)}) {
    grey += 30.0 * std::exp(-0.5 * blur * blur * k.squaredNorm()) * std::sin(k.dot(at));
  }
  return grey;
}

/// Of the energy of patterns at their true places, what is left when they are blurred alike.
TEST_F(OtherSizes, PatternsAreComparedAsTheTargetBlursThem) {
  for (const Change& change :
       {Change{.size = 0.5}, Change{.size = 0.6}, Change{.size = 0.7}, Change{.size = 0.8},
        Change{.shift = 0.4}, Change{.size = 0.75, .roll = 0.5 * std::numbers::pi},
        Change{.size = 0.55, .roll = 0.5 * std::numbers::pi}}) {
    const Window seen = window(change, lens_waves);
    double before = 0.0;
    double after = 0.0;
    int points = 0;
    for (int v = 80; v < 165; v += 7) {
      for (int u = 110; u < 210; u += 7) {
        const LinearizedResidual as_is = residual(seen, u, v, false);
        if (as_is.state != ResidualState::kIn) continue;
        before += static_cast<double>(as_is.rr);
        after += static_cast<double>(residual(seen, u, v, true).rr);
        ++points;
      }
    }
    EXPECT_GT(points, 100);
    EXPECT_GT(before, 5.0 * points) << "the test needs patterns that blur changes";
    EXPECT_LT(after, 0.1 * before) << "size " << change.size << ", roll " << change.roll;
  }
}

/// A white line along the motion, which is as wide as it is near: it looks alike wherever one is,
/// but for the lens, which blurs it where it is narrow. Where the target shows it smaller that is
/// what a match short of its place has less of.
TEST_F(OtherSizes, ALineAlongTheMotionDoesNotHoldItBack) {
  const auto line = [](double x, double y, double blur) {
    // Between two rays from the middle, at a slope of 1 in 4, about 4 px apart where it is 60 px
    // away.
    const double along = std::max((x + 0.25 * y) / std::hypot(1.0, 0.25), 1.0);
    const double across = (y - 0.25 * x) / std::hypot(1.0, 0.25);
    const double half = 0.035 * along;
    const double unit = 1.0 / (blur * std::sqrt(2.0));
    return 80.0 + 50.0 * (std::erf((across + half) * unit) - std::erf((across - half) * unit));
  };
  const auto short_by = [&](double size, bool equal_blur) {
    const Window seen = window({.size = size}, line);
    double hessian = 0.0;
    double gradient = 0.0;
    for (int u = 200; u < 290; ++u) {
      for (int v = 120; v < 170; ++v) {
        const LinearizedResidual r = residual(seen, u, v, equal_blur);
        if (r.state != ResidualState::kIn) continue;
        hessian += static_cast<double>(depth_part(r).hessian);
        gradient += static_cast<double>(depth_part(r).gradient);
      }
    }
    EXPECT_GT(hessian, 0.0);
    return gradient / hessian;  // of the inverse depth, which the way stands for
  };
  for (const double size : {0.5, 0.6, 0.7}) {
    const double before = short_by(size, false);
    const double after = short_by(size, true);
    EXPECT_GT(before, 0.005) << "the test needs a line that does";
    EXPECT_LT(std::abs(after), 0.25 * before) << before << ", size " << size;
  }
}

}  // namespace
}  // namespace sovo
