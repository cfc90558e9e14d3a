#include "sovo/vo/two_view_initializer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

constexpr double kDegree = M_PI / 180.0;

CameraModel test_camera() {
  CameraModel camera;
  camera.width = 480;
  camera.height = 360;
  camera.fx = 330.0;
  camera.fy = 335.0;
  camera.cx = 241.0;
  camera.cy = 178.0;
  return camera;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::acos(std::min(1.0, a.normalized().dot(b.normalized())));
}

/// Renders the frames of a motion, feeds them until the initializer stops, and returns the status.
struct Outcome {
  TwoViewInitializer::Status status = TwoViewInitializer::Status::kNotYet;
  TwoViewResult result;
  std::string reason;
  SE3 T_world_first, T_world_newest;
};

template <class Motion>
Outcome feed(const test::SyntheticScene& scene, const Motion& T_world_camera, int frames,
             double gain_step = 0.0, std::vector<ImagePyramidPtr>* rendered = nullptr) {
  const CameraModel camera = test_camera();
  TwoViewInitializer initializer;
  PixelSelector selector;
  Outcome out;
  for (int i = 0; i <= frames; ++i) {
    ImagePyramidPtr pyramid;
    if (rendered != nullptr && static_cast<std::size_t>(i) < rendered->size()) {
      pyramid = (*rendered)[static_cast<std::size_t>(i)];
    } else {
      ImageF image = scene.render(camera, T_world_camera(i));
      test::apply_brightness(1.0 - gain_step * i, 2.0 * gain_step * i, &image);
      test::add_noise(1.5, static_cast<unsigned>(i), &image);
      pyramid = test::pyramid_of(std::move(image));
      if (rendered != nullptr) rendered->push_back(pyramid);
    }
    if (i == 0) {
      EXPECT_TRUE(initializer.set_first(0, pyramid, camera, nullptr, &selector));
      continue;
    }
    out.status = initializer.track(i, pyramid);
    if (out.status != TwoViewInitializer::Status::kNotYet) break;
  }
  out.result = initializer.result();
  out.reason = initializer.reason();
  out.T_world_first = T_world_camera(0);
  out.T_world_newest = T_world_camera(static_cast<int>(out.result.newest_stamp_ns));
  return out;
}

TEST(TwoViewInitializer, RecoversPoseAndDepthUpToScale) {
  const test::SyntheticScene scene(3);
  const auto motion = [](int i) {
    return SE3(SO3::exp(Vec3(0.008, -0.016, 0.02) * i), Vec3(0.09, 0.024, 0.03) * i);
  };
  const Outcome r = feed(scene, motion, 8, 0.02);
  ASSERT_EQ(r.status, TwoViewInitializer::Status::kReady) << r.reason;
  const SE3 truth = r.T_world_newest.inverse() * r.T_world_first;
  const SE3& estimate = r.result.T_newest_first;
  EXPECT_LT((estimate.rotation() * truth.rotation().inverse()).log().norm(), 0.3 * kDegree);
  EXPECT_LT(angle_between(estimate.translation(), truth.translation()), 2.0 * kDegree);
  const double gain = 1.0 - 0.02 * static_cast<double>(r.result.newest_stamp_ns);
  // Noise and interpolation of the second image pull the gain a little towards zero.
  EXPECT_NEAR(r.result.a, gain, 0.05);

  const double scale = truth.translation().norm() / estimate.translation().norm();
  double mean = 0.0;
  int close = 0;
  for (const InitialPoint& p : r.result.points) {
    mean += p.inverse_depth;
    const double depth = scene.depth(test_camera(), r.T_world_first, Vec2(p.u, p.v));
    if (std::abs(std::log(scale / p.inverse_depth / depth)) < 0.1) ++close;
    EXPECT_GT(p.sigma, 0.0F);
  }
  const double count = static_cast<double>(r.result.points.size());
  EXPECT_GE(count, 600.0);
  EXPECT_NEAR(mean / count, 1.0, 1e-3);
  EXPECT_GT(close, 0.8 * count);
}

TEST(TwoViewInitializer, IsNotFooledByPureRotation) {
  const test::SyntheticScene scene(4);
  const auto motion = [](int i) {
    return SE3(SO3::exp(Vec3(0.006, 0.02 * std::sin(0.9 * i), 0.012) * i), Vec3::Zero());
  };
  const Outcome r = feed(scene, motion, 6);
  EXPECT_EQ(r.status, TwoViewInitializer::Status::kNotYet);
  EXPECT_FALSE(r.reason.empty());
}

TEST(TwoViewInitializer, SameInputGivesTheSameBytes) {
  const test::SyntheticScene scene(5);
  const auto motion = [](int i) { return SE3(SO3(), Vec3(-0.09, 0.02, 0.03) * i); };
  std::vector<ImagePyramidPtr> rendered;
  const Outcome a = feed(scene, motion, 8, 0.0, &rendered);
  const Outcome b = feed(scene, motion, 8, 0.0, &rendered);
  ASSERT_EQ(a.status, TwoViewInitializer::Status::kReady) << a.reason;
  EXPECT_EQ(a.result.newest_stamp_ns, b.result.newest_stamp_ns);
  EXPECT_EQ(a.result.T_newest_first.matrix(), b.result.T_newest_first.matrix());
  ASSERT_EQ(a.result.points.size(), b.result.points.size());
  for (std::size_t i = 0; i < a.result.points.size(); ++i) {
    EXPECT_EQ(a.result.points[i].inverse_depth, b.result.points[i].inverse_depth);
  }
}

TEST(TwoViewInitializer, RefusesAFrameWithoutTextureAndGivesUpWhenLost) {
  ImageF flat(480, 360);
  flat.fill(100.0F);
  TwoViewInitializer initializer;
  PixelSelector selector;
  EXPECT_FALSE(initializer.set_first(0, test::pyramid_of(flat), test_camera(), nullptr, &selector));

  const test::SyntheticScene scene(6);
  const auto first = test::pyramid_of(scene.render(test_camera(), SE3()));
  ASSERT_TRUE(initializer.set_first(0, first, test_camera(), nullptr, &selector));
  auto status = TwoViewInitializer::Status::kNotYet;
  for (int i = 1; i <= 10 && status == TwoViewInitializer::Status::kNotYet; ++i) {
    status = initializer.track(i, test::pyramid_of(flat));
  }
  EXPECT_EQ(status, TwoViewInitializer::Status::kFailed);
}

/// Waves of a period much longer than a pixel: interpolation adds almost nothing.
ImageF smooth_image(double phase) {
  ImageF image(200, 160);
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 200; ++x) {
      image.at(x, y) = static_cast<float>(120.0 + 60.0 * std::sin(0.09 * x + 0.05 * y + phase) +
                                          40.0 * std::cos(0.07 * y - 0.04 * x));
    }
  }
  return image;
}

TEST(TwoViewRefinement, JacobiansAgreeWithCentralDifferences) {
  const ImageF first = smooth_image(0.0);
  const ImageF second = smooth_image(0.7);
  CameraModel camera;
  camera.width = 200;
  camera.height = 160;
  camera.fx = 150.0;
  camera.fy = 155.0;
  camera.cx = 99.0;
  camera.cy = 81.0;
  TwoViewState state;
  state.T_1_0 = SE3(SO3::exp(Vec3(0.02, -0.03, 0.05)), Vec3(0.1, -0.04, 0.06));
  state.a = 0.9;
  state.b = 4.0;
  for (const auto& [x, y] : {std::pair{60.0F, 50.0F}, std::pair{120.0F, 100.0F}}) {
    const float rho = 0.8F;
    TwoViewPixel pixel;
    ASSERT_TRUE(evaluate_pixel(first, second, camera, state, x, y, rho, &pixel));
    const auto residual = [&, px = x, py = y](int k, double step) {
      TwoViewState moved = state;
      float moved_rho = rho;
      if (k < 6) {
        moved.T_1_0 = SE3::exp(Vec6(step * Vec6::Unit(k))) * state.T_1_0;
      } else if (k == 6) {
        moved.a += step;
      } else if (k == 7) {
        moved.b += step;
      } else {
        moved_rho += static_cast<float>(step);
      }
      TwoViewPixel at;
      EXPECT_TRUE(evaluate_pixel(first, second, camera, moved, px, py, moved_rho, &at));
      return static_cast<double>(at.residual);
    };
    for (int k = 0; k < 9; ++k) {
      const double h = k == 7 ? 1.0 : (k == 8 ? 0.05 : 0.01);
      const double numeric = (residual(k, h) - residual(k, -h)) / (2.0 * h);
      const double analytic = k < 8 ? pixel.J[static_cast<std::size_t>(k)] : pixel.J_rho;
      EXPECT_NEAR(analytic, numeric, 0.02 * std::abs(numeric) + 2.0) << "unknown " << k;
    }
  }
}

std::vector<Correspondence> correspondences(const SE3& T_1_0, int count, double outliers,
                                            double noise) {
  std::mt19937 random(11);
  std::vector<Correspondence> matches;
  for (int i = 0; i < count; ++i) {
    const double x = test::uniform(random, -0.7, 0.7), y = test::uniform(random, -0.5, 0.5);
    const Vec3 p = T_1_0 * (Vec3(x, y, 1.0) * test::uniform(random, 2.0, 8.0));
    Correspondence m{x, y, p.x() / p.z() + noise * test::normal(random),
                     p.y() / p.z() + noise * test::normal(random)};
    if (test::uniform(random) < outliers) {
      m.x1 += test::uniform(random, -0.2, 0.2);
      m.y1 += test::uniform(random, -0.2, 0.2);
    }
    matches.push_back(m);
  }
  return matches;
}

TEST(EpipolarPose, FindsThePoseAmongOutliers) {
  const double focal = 400.0;
  const Vec3 directions[] = {{1, 0, 0}, {0, -1, 0.2}, {0.1, 0.1, 1}, {-0.5, 0.5, -0.7}};
  for (const Vec3& direction : directions) {
    const SE3 truth(SO3::exp(Vec3(0.03, -0.05, 0.08)), 0.4 * direction.normalized());
    const auto matches = correspondences(truth, 300, 0.3, 0.3 / focal);
    const EpipolarPose pose = estimate_epipolar_pose(matches, focal, SE3(), 7);
    ASSERT_TRUE(pose.valid);
    EXPECT_LT((pose.T_1_0.rotation() * truth.rotation().inverse()).log().norm(), 0.2 * kDegree);
    EXPECT_LT(angle_between(pose.T_1_0.translation(), direction), 2.0 * kDegree);
    EXPECT_GE(pose.inliers, 190);
    EXPECT_LT(pose.direction_sigma, 1.0 * kDegree);
  }
}

TEST(EpipolarPose, RotationAloneIsFittedExactly) {
  const SE3 truth(SO3::exp(Vec3(0.1, -0.05, 0.2)), Vec3::Zero());
  const auto matches = correspondences(truth, 200, 0.2, 0.0);
  double cost = 0.0, median_px = 0.0;
  const SO3 R = estimate_rotation(matches, 400.0, SO3(), 5.0, &cost, &median_px);
  EXPECT_LT((R * truth.rotation().inverse()).log().norm(), 0.05 * kDegree);
  EXPECT_LT(median_px, 0.2);
}

TEST(EpipolarPose, TriangulationInvertsProjection) {
  const SE3 T_1_0(SO3::exp(Vec3(0.02, 0.03, -0.01)), Vec3(0.2, 0.1, -0.05));
  const Vec3 point(0.5, -0.3, 2.5);
  const Vec3 p = T_1_0 * point;
  const Correspondence m{point.x() / point.z(), point.y() / point.z(), p.x() / p.z(),
                         p.y() / p.z()};
  double sigma = 0.0;
  EXPECT_NEAR(triangulate_inverse_depth(m, T_1_0, 400.0, &sigma), 0.4, 1e-9);
  // One pixel along the epipolar line changes the inverse depth by sigma.
  Correspondence moved = m;
  const Vec2 along =
      (T_1_0.translation().head<2>() - Vec2(m.x1, m.y1) * T_1_0.translation().z()).normalized() *
      0.01 / 400.0;
  moved.x1 += along.x();
  moved.y1 += along.y();
  double unused = 0.0;
  EXPECT_NEAR(std::abs(triangulate_inverse_depth(moved, T_1_0, 400.0, &unused) - 0.4) / 0.01, sigma,
              0.02 * sigma);
}

TEST(PatchTracker, FollowsAShiftOfSeveralPixelsWithAChangeOfContrast) {
  const test::SyntheticScene scene(8);
  const CameraModel camera = test_camera();
  const ImageF image = scene.render(camera, SE3());
  ImageF shifted(camera.width, camera.height);
  shifted.fill(0.0F);
  for (int y = 4; y < camera.height; ++y) {
    for (int x = 7; x < camera.width; ++x) {
      shifted.at(x, y) = 0.8F * image.at(x - 7, y - 4) + 10.0F;
    }
  }
  std::vector<PatchTracker::Position> candidates;
  for (int y = 60; y < 300; y += 15) {
    for (int x = 60; x < 420; x += 15) {
      candidates.push_back({static_cast<float>(x), static_cast<float>(y)});
    }
  }
  PatchTracker tracker;
  tracker.set_first(test::pyramid_of(image), camera, candidates);
  ASSERT_GE(tracker.tracks().size(), 50U);
  const auto next = test::pyramid_of(shifted);
  tracker.track(*next, SO3(), SO3());
  int right = 0;
  for (const PatchTrack& t : tracker.tracks()) {
    if (!t.followed) continue;
    if (std::hypot(t.u - t.u0 - 7.0F, t.v - t.v0 - 4.0F) < 0.2F) ++right;
  }
  EXPECT_GT(right, 0.8 * static_cast<double>(tracker.tracks().size()));
  EXPECT_NEAR(tracker.gain(), 0.8, 0.02);
}

}  // namespace
}  // namespace sovo
