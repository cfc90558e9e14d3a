#include "sovo/vo/motion_blur.h"

#include <gtest/gtest.h>

#include "sovo/image/interpolation.h"
#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/exposure_estimate.h"
#include "support/numeric.h"
#include "support/same_bits.h"
#include "vo/drive_test_support.h"

namespace sovo {
namespace {

using namespace test;

TEST(Streak, IsTheWayOfAPixelDuringTheExposure) {
  const CameraModel camera = small_camera();
  const Vec6 motion = (Vec6() << 0.003, -0.002, 0.004, 0.004, -0.003, 0.005).finished();
  for (const Vec2& pixel : {Vec2(20, 30), Vec2(180, 40), Vec2(100, 140)}) {
    const Vec3 ray = *camera.unproject(pixel);
    const Vec3 p = 2.5 / ray.z() * ray;
    const Vec2 way =
        *camera.project(SE3::exp(0.5 * motion) * p) - *camera.project(SE3::exp(-0.5 * motion) * p);
    const Vec3 normalized = p / p.z();
    const Eigen::Vector2f found =
        streak(camera, motion.cast<float>(), static_cast<float>(normalized.x()),
               static_cast<float>(normalized.y()), static_cast<float>(1.0 / p.z()));
    EXPECT_LT((found.cast<double>() - way).norm(), 1e-3 * way.norm() + 1e-4);
  }
}

TEST(Streak, LongestIsThatOfACornerAndOfWhatIsNear) {
  const CameraModel camera = small_camera();
  const Exposed turn = (Exposed() << 0, 0, 0, 0, 0, 0.1F).finished();
  EXPECT_NEAR(
      longest_streak(camera, turn, 1.0),
      0.1 * std::hypot(camera.fx * std::max(camera.cx, camera.width - camera.cx) / camera.fx,
                       std::max(camera.cy, camera.height - camera.cy)),
      0.2);
  const Exposed sideways = (Exposed() << 0.02F, 0, 0, 0, 0, 0).finished();
  EXPECT_NEAR(longest_streak(camera, sideways, 0.5), 0.01 * camera.fx, 1e-3);
  EXPECT_EQ(longest_streak(camera, Exposed::Zero(), 1.0), 0.0);
}

Eigen::Matrix2d covariance(const Eigen::Vector2f& line) {
  const Vec2 d = line.cast<double>();
  return d * d.transpose() / 12.0;
}

TEST(BlurDifference, BothImagesAreBlurredAlikeWithIt) {
  std::mt19937 random(3);
  const auto draw = [&] {
    return Eigen::Vector2f(static_cast<float>(uniform(random, -15, 15)),
                           static_cast<float>(uniform(random, -15, 15)));
  };
  for (int i = 0; i < 200; ++i) {
    Eigen::Matrix2f warp;
    warp << 1.1F, 0.2F, -0.15F, 0.9F;
    const Eigen::Vector2f host = draw();
    const Eigen::Vector2f target = draw();
    const BlurDifference d = blur_difference(host, warp, target);
    const Eigen::Matrix2d W = warp.cast<double>();
    const Eigen::Matrix2d left = W * (covariance(host) + covariance(d.host)) * W.transpose();
    const Eigen::Matrix2d right = covariance(target) + covariance(d.target);
    EXPECT_LT((left - right).norm(), 1e-4 * right.norm() + 0.5) << i;
    if (d.host.norm() + d.target.norm() > 0.0F) {
      EXPECT_LT((left - right).norm(), 1e-4 * right.norm()) << i;
    }
  }
}

TEST(BlurDifference, IsWhatOneSideLacks) {
  const Eigen::Matrix2f same = Eigen::Matrix2f::Identity();
  const Eigen::Vector2f line(8.0F, 3.0F);
  const Eigen::Vector2f none(0.0F, 0.0F);
  // There and back again is the same blur.
  for (const float sign : {1.0F, -1.0F}) {
    const BlurDifference alike = blur_difference(line, same, sign * line);
    EXPECT_EQ(alike.host.norm() + alike.target.norm(), 0.0F);
  }
  const BlurDifference sharp_host = blur_difference(none, same, line);
  EXPECT_LT((sharp_host.host - line).norm(), 1e-3F);
  EXPECT_LT(sharp_host.target.norm(), 0.01F);
  const BlurDifference sharp_target = blur_difference(line, same, none);
  EXPECT_LT(sharp_target.host.norm(), 0.01F);
  EXPECT_NEAR(std::abs(sharp_target.target.normalized().dot(line.normalized())), 1.0F, 1e-5F);
  EXPECT_NEAR(sharp_target.target.norm(), line.norm(), 1e-3F);
  const BlurDifference crossed =
      blur_difference(Eigen::Vector2f(0.0F, 6.0F), same, Eigen::Vector2f(9.0F, 0.0F));
  EXPECT_NEAR(std::abs(crossed.host.x()), 9.0F, 1e-3F);
  EXPECT_NEAR(std::abs(crossed.target.y()), 6.0F, 1e-3F);
}

TEST(SmearAlong, TakesPlacesAsTheLineIsLong) {
  EXPECT_EQ(smear_along({0.5F, 0.5F}).places, 1);
  EXPECT_EQ(smear_along({std::nanf(""), 1.0F}).places, 1);
  EXPECT_EQ(smear_along({0.0F, 2.0F}).places, 2);
  EXPECT_EQ(smear_along({6.0F, -8.0F}).places, 5);
  EXPECT_EQ(smear_along({600.0F, 800.0F}).places, 12);
  EXPECT_EQ(smear_along({6.0F, -8.0F}).v, -8.0F);
}

TEST(SmearedPattern, IsTheMeanAlongTheLine) {
  const ImageF image = blurred(noise_image(100, 80, 5));
  const Smear smear = smear_along({7.0F, -4.0F});
  const PatternWarp warp = {{50.3F, 40.6F, 1.0F},
                            {1.05F, 0.1F, 0.0F},
                            {-0.08F, 0.95F, 0.0F},
                            image.width(),
                            image.height()};
  SmearedPattern smeared;
  ASSERT_TRUE(run_kernel<SmearPattern>(image, warp, smear, &smeared));
  std::array<float, kPatternSize> colours{};
  ASSERT_TRUE(run_kernel<SmearColours>(image, 50.0F, 40.0F, smear, colours.data()));
  for (std::size_t k = 0; k < kPatternSize; ++k) {
    const float u = 50.3F + 1.05F * kPattern[k].x - 0.08F * kPattern[k].y;
    const float v = 40.6F + 0.1F * kPattern[k].x + 0.95F * kPattern[k].y;
    Sample mean{};
    float colour = 0.0F;
    const auto n = static_cast<float>(smear.places);
    for (int i = 0; i < smear.places; ++i) {
      const float along = (static_cast<float>(i) + 0.5F) / n - 0.5F;
      const Sample s = sample_with_gradient(image, u + along * smear.u, v + along * smear.v);
      mean.value += s.value / n;
      mean.gx += s.gx / n;
      mean.gy += s.gy / n;
      colour += sample(image, 50.0F + kPattern[k].x + along * smear.u,
                       40.0F + kPattern[k].y + along * smear.v) /
                n;
    }
    EXPECT_NEAR(smeared.value[k], mean.value, 0.01F);
    EXPECT_NEAR(smeared.gx[k], mean.gx, 0.01F);
    EXPECT_NEAR(smeared.gy[k], mean.gy, 0.01F);
    EXPECT_NEAR(colours[k], colour, 0.01F);
  }
}

TEST(SmearedPattern, LooksNowhereBesideTheImage) {
  const ImageF image = noise_image(60, 50, 5);
  const Smear smear = smear_along({30.0F, 0.0F});
  PatternWarp warp = {
      {30.0F, 25.0F, 1.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 1.0F, 0.0F}, image.width(), image.height()};
  SmearedPattern smeared;
  std::array<float, kPatternSize> colours{};
  EXPECT_TRUE(run_kernel<SmearPattern>(image, warp, smear, &smeared));
  EXPECT_TRUE(run_kernel<SmearColours>(image, 30.0F, 25.0F, smear, colours.data()));
  for (const float u : {12.0F, 48.0F, std::nanf("")}) {
    warp.centre[0] = u;
    EXPECT_FALSE(run_kernel<SmearPattern>(image, warp, smear, &smeared)) << u;
    EXPECT_FALSE(run_kernel<SmearColours>(image, u, 25.0F, smear, colours.data())) << u;
  }
  EXPECT_FALSE(run_kernel<SmearColours>(image, 30.0F, 1.0F, smear, colours.data()));
  EXPECT_FALSE(run_kernel<SmearColours>(image, 30.0F, 48.0F, smear, colours.data()));
}

/// What a camera sees that moves by `motion`, log(T_later_earlier), while it exposes.
ImageF exposed_view(const SyntheticScene& scene, const SE3& T_world_camera, const Vec6& motion) {
  constexpr int kInstants = 9;
  const CameraModel camera = small_camera();
  ImageF sum(camera.width, camera.height);
  for (std::size_t i = 0; i < sum.size(); ++i) sum.data()[i] = 0.0F;
  for (int k = 0; k < kInstants; ++k) {
    const double share = (k + 0.5) / kInstants - 0.5;
    const SE3 T_later_camera = SE3::exp(share * motion);
    const ImageF view = scene.render(camera, T_world_camera * T_later_camera.inverse());
    for (std::size_t i = 0; i < sum.size(); ++i) sum.data()[i] += view.data()[i] / kInstants;
  }
  return blurred(sum);
}

constexpr double kExposure = 0.02;

/// Such a view, rendered once.
ImagePyramidPtr known_view(const SyntheticScene& scene, int i, double exposure,
                           const Vec6& motion) {
  static std::map<std::pair<int, double>, ImagePyramidPtr> views;
  ImagePyramidPtr& view = views[{i, exposure}];
  if (!view) view = pyramid_of(exposed_view(scene, keyframe_pose(i), motion));
  return view;
}

/// Three keyframes of a scene, which turn in different ways while they expose.
class BlurredWindow {
 public:
  /// `newest_share`: of its velocity that the newest one had while it was exposed.
  explicit BlurredWindow(double exposure, double newest_share = 1.0) : window_(small_camera()) {
    std::vector<SE3> poses;
    for (int i = 0; i < kKeyframes; ++i) poses.push_back(keyframe_pose(i));
    for (int i = 0; i < kKeyframes; ++i) {
      const SE3& pose = poses[static_cast<std::size_t>(i)];
      const double share = i + 1 < kKeyframes ? 1.0 : newest_share;
      Keyframe& k = window_.insert(make_keyframe(
          static_cast<std::uint32_t>(i),
          known_view(scene_, i, share * exposure, share * exposure * velocity(i)), pose));
      k.velocity = velocity(i);
      k.points = scene_points(scene_, small_camera(), k.image(), poses, i, 4);
      k.outlier_threshold = kPatternSize * 144.0;
    }
    for (int h = 0; h < kKeyframes; ++h) {
      for (Point& p : window_[h].points) {
        for (int t = 0; t < kKeyframes; ++t) {
          if (t != h)
            p.residuals[static_cast<std::size_t>(window_[t].slot)].state = ResidualState::kIn;
        }
      }
    }
    window_.update_geometry();
  }

  /// Up to 400 px/s.
  static Vec6 velocity(int i) {
    const double angle = 0.9 * i;
    return (Vec6() << 0.1, 0.0, -0.2, 2.4 * std::sin(angle), 2.4 * std::cos(angle), 0.3).finished();
  }

  Window& window() { return window_; }
  double energy(double exposure) {
    window_.set_exposures(exposure);
    return energy_into_newest({}, window_);
  }

 private:
  static constexpr int kKeyframes = 3;
  SyntheticScene scene_{3};
  Window window_;
};

TEST(BlurredResiduals, AreThoseOfTheNoiseWhenTheBlurIsKnown) {
  BlurredWindow blurred(kExposure);
  const double without = blurred.energy(0.0);
  const double with = blurred.energy(kExposure);
  EXPECT_LT(with, 0.25 * without);
  EXPECT_GT(blurred.energy(2.0 * kExposure), 1.5 * with);
  blurred.window().newest().velocity.reset();
  EXPECT_EQ(blurred.energy(kExposure), blurred.energy(0.0)) << "of one image blur is not known";
}

TEST(BlurredResiduals, DoNotChangeWithTheMapsUnit) {
  BlurredWindow blurred(kExposure);
  const double before = blurred.energy(kExposure);
  blurred.window().apply_similarity(1.7);
  EXPECT_NEAR(energy_into_newest({}, blurred.window()), before, 1e-3 * before);
  EXPECT_NEAR(blurred.energy(kExposure), before, 1e-3 * before) << "as the velocities say";
}

/// The gradient is that of the images as they are blurred further.
TEST(BlurredResiduals, GradientAgreesWithCentralDifferences) {
  BlurredWindow blurred(kExposure);
  Window& window = blurred.window();
  window.set_exposures(kExposure);
  WindowConfig config;
  config.huber = 1e6;              // weights that do not hang on residuals,
  config.gradient_constant = 1e6;  // nor on gradients
  double gradient = 0.0;
  double numeric = 0.0;
  double squares = 0.0;
  for (Point p : window[0].points) {
    p.weight.fill(1.0F);
    LinearizedResidual r;
    const Residual in{.state = ResidualState::kIn};
    linearize(window, config, 0, 2, p, in, &r);
    if (r.state != ResidualState::kIn) continue;
    const double here = static_cast<double>(depth_part(r).gradient);
    const double rho = p.rho;
    const double step = 2e-3 * rho;
    p.rho = rho + step;
    linearize(window, config, 0, 2, p, in, &r);
    const double above = static_cast<double>(r.rr);
    p.rho = rho - step;
    linearize(window, config, 0, 2, p, in, &r);
    const double there = (above - static_cast<double>(r.rr)) / (4.0 * step);
    gradient += here * there;
    numeric += there * there;
    squares += here * here;
  }
  ASSERT_GT(numeric, 0.0);
  EXPECT_NEAR(gradient / numeric, 1.0, 0.07) << "the pattern moves with its centre";
  EXPECT_GT(gradient / std::sqrt(numeric * squares), 0.97) << "correlation";
}

TEST(ExposureEstimate, FindsHowLongImagesWereExposed) {
  for (const double exposure : {0.0, 0.01, 0.02}) {
    BlurredWindow blurred(exposure);
    ExposureEstimate estimate({});
    estimate.settle({}, &blurred.window());
    // Here 2.5 ms are a pixel, which sharp images hardly tell from none.
    if (exposure > 0.0) {
      EXPECT_EQ(estimate.seconds(), exposure);
    } else {
      EXPECT_LE(estimate.seconds(), 0.0025);
    }
  }
}

TEST(ExposureEstimate, TakesAKnownTimeAndMayBeToldToEstimateNone) {
  BlurredWindow blurred(kExposure);
  for (int i = 0; i < 3; ++i) blurred.window()[i].exposure_s = kExposure;
  ExposureEstimate estimate({});
  estimate.settle({}, &blurred.window());
  EXPECT_EQ(estimate.seconds(), 0.0);
  EXPECT_TRUE(blurred.window().pair(0, 2).blurred);
  EXPECT_FLOAT_EQ(blurred.window()[2].exposed[3],
                  static_cast<float>(kExposure * BlurredWindow::velocity(2)[3]));
  for (int i = 0; i < 3; ++i) blurred.window()[i].exposure_s = 0.0;
  ExposureEstimate none({.enable = true, .least_share = 0.0});
  none.settle({}, &blurred.window());
  EXPECT_FALSE(blurred.window().pair(0, 2).blurred);
}

TEST(ExposureEstimate, ForgetsAVelocityThatFitsWorseThanNone) {
  for (const bool moved : {true, false}) {
    BlurredWindow blurred(moved ? kExposure : 0.0);
    Window& window = blurred.window();
    for (int i = 0; i < 3; ++i) window[i].exposure_s = kExposure;
    ExposureEstimate({}).settle({}, &window);
    EXPECT_EQ(window.newest().velocity.has_value(), moved);
    EXPECT_EQ(window.pair(0, 2).blurred, moved);
  }
}

TEST(ExposureEstimate, TakesAsMuchOfAVelocityAsIsSeen) {
  for (const double share : {1.0, 0.5, 0.0}) {
    BlurredWindow blurred(kExposure, share);
    Window& window = blurred.window();
    for (int i = 0; i < 3; ++i) window[i].exposure_s = kExposure;
    ExposureEstimate({}).settle({}, &window);
    ASSERT_TRUE(window.newest().velocity.has_value());
    EXPECT_EQ(*window.newest().velocity, Vec6(share * BlurredWindow::velocity(2)));
    EXPECT_TRUE(window.pair(0, 2).blurred) << "for the host is";
  }
}

TEST(BlurredDrive, KnowsHowFastItsKeyframesMoved) {
  const SyntheticScene scene(3);
  const Vec6 velocity = (Vec6() << 0.7, 0.0, 0.3, 0.0, -0.6, 0.0).finished();
  for (const bool enable : {true, false}) {
    DirectConfig config;
    config.motion_blur.enable = enable;
    WorkerPool pool(1);
    DirectOdometry vo(config, small_camera(), ImageU8(), 0, &pool);
    const MonoFrame first = frame_at(scene, drive(0), 0);
    std::vector<StartPoint> points;
    for (const SelectedPixel& pixel : vo.select_pixels(first, 600)) {
      const double depth = scene.depth(small_camera(), drive(0), Vec2(pixel.x, pixel.y));
      points.push_back({pixel, {static_cast<float>(1.0 / depth), 0.01F}});
    }
    vo.begin(first, drive(0), points, nullptr);
    EXPECT_FALSE(vo.window()[0].velocity.has_value());
    TrackedFrame tracked = vo.track(frame_at(scene, drive(1), 1), 0.0);
    ASSERT_TRUE(tracked.tracking.good);
    tracked.wants_keyframe = true;
    tracked.frame.velocity = velocity;
    vo.map(tracked, {}, nullptr);
    ASSERT_EQ(vo.window().size(), 2);
    for (int i = 0; i < 2; ++i) {
      const auto& known = vo.window()[i].velocity;
      EXPECT_EQ(known.has_value(), enable);
      EXPECT_EQ(known.value_or(velocity), velocity) << i;
    }
    if (!enable) continue;
    // What is tracked against a map that is rescaled before it is mapped moves as that has it.
    tracked = vo.track(frame_at(scene, drive(2), 2), 0.0);
    ASSERT_TRUE(tracked.tracking.good);
    tracked.wants_keyframe = true;
    tracked.frame.velocity = velocity;
    ScaleCorrection correction;
    correction.log_scale = std::log(1.25);
    vo.apply(correction);
    vo.map(tracked, {}, nullptr);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR((*vo.window()[i].velocity)[0], 1.25 * velocity[0], 1e-6) << i;
      EXPECT_NEAR((*vo.window()[i].velocity)[4], velocity[4], 1e-9) << i;
    }
  }
}

}  // namespace
}  // namespace sovo
