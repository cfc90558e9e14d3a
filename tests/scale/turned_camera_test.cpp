#include <gtest/gtest.h>

#include "scale/scale_test_support.h"
#include "sovo/scale/scale_alignment.h"

namespace sovo {
namespace {

using test::make_keyframe;
using test::make_rig;
using test::pyramid_of;
using test::Right;
using test::scene;
using test::StereoView;
using test::view;

class TurnedCamera : public testing::TestWithParam<Right> {
 protected:
  /// Images of a right camera that is turned by `px` against the calibration that comes with them.
  static StereoView turned_view(const Vec3& px) {
    const StereoRig rig = make_rig(GetParam());
    StereoView v = test::render_view(scene(1), rig.turned(SO3::exp(px / rig.right.fx)));
    v.rig = rig;
    return v;
  }
};

INSTANTIATE_TEST_SUITE_P(Lenses, TurnedCamera,
                         testing::Values(Right::kRectified, Right::kRadtan, Right::kEquidistant));

TEST_P(TurnedCamera, IsFoundWithTheScale) {
  for (const Vec3& px : {Vec3(0.3, 0, 0), Vec3(0, -0.3, 0), Vec3(0, 0, 0.4), Vec3(0.2, 0.3, -0.3),
                         Vec3(4, 0, 0), Vec3(0, 3, 0), Vec3(0, 0, -6), Vec3(-2, 2, 3)}) {
    const StereoView v = turned_view(px);
    const double focal = v.rig.right.fx;
    for (const bool cold : {false, true}) {
      const auto keyframe = make_keyframe(v, scene(1), {.log_scale = cold ? 1.0 : 0.02});
      const ScaleEstimate found =
          ScaleOptimizer({}, v.rig).estimate(keyframe, *pyramid_of(v.right), cold);
      ASSERT_TRUE(found.turn.valid) << px.transpose();
      EXPECT_LT((focal * found.turn.turn - px).norm(), 0.05 + 0.03 * px.norm()) << px.transpose();
      EXPECT_LT(focal * found.turn.sigma.maxCoeff(), 0.1);
      EXPECT_LT(focal * found.turn.disagreement.maxCoeff(), 0.05) << px.transpose();
    }
  }
}

// Its distortion calibrated wrongly by a pixel and more in the corners: no turn explains that.
TEST_P(TurnedCamera, ALensThatIsDescribedBadlyIsSeenInPartsOfTheImage) {
  StereoView v = turned_view(Vec3::Zero());
  CameraModel& lens = v.rig.right;
  if (lens.distortion == Distortion::kNone) {
    lens.distortion = Distortion::kRadtan;
    lens.num_coefficients = 4;
  }
  lens.d[0] += 0.04;
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = 0.02});
  const ScaleEstimate found =
      ScaleOptimizer({}, v.rig).estimate(keyframe, *pyramid_of(v.right), false);
  ASSERT_TRUE(found.turn.valid);
  EXPECT_GT(lens.fx * found.turn.disagreement.maxCoeff(), 0.1);
}

TEST_P(TurnedCamera, IsUndone) {
  const Vec3 px(1.5, -2.0, 2.5);
  const StereoView v = turned_view(px);
  const SO3 turn = SO3::exp(px / v.rig.right.fx);
  const ScaleOptimizer optimizer({}, v.rig);
  const auto keyframe = make_keyframe(v, scene(1), {.log_scale = 0.02});
  const auto right = pyramid_of(v.right);
  const ScaleEstimate undone = optimizer.estimate(keyframe, *right, false, SE3(), turn);
  EXPECT_EQ(undone.verdict, ScaleVerdict::kAccepted);
  EXPECT_NEAR(undone.log_scale, 0.02, 0.002);
  EXPECT_LT(v.rig.right.fx * undone.turn.turn.norm(), 0.05);
  EXPECT_GT(std::abs(optimizer.estimate(keyframe, *right, false).log_scale - 0.02), 0.02);
}

TEST_P(TurnedCamera, TellsWhatItMakesOfTheScale) {
  const StereoView& v = view(GetParam());
  const ScaleOptimizer optimizer({}, v.rig);
  const auto keyframe = make_keyframe(v, scene(1), {});
  const auto right = pyramid_of(v.right);
  const Vec3 slope = optimizer.estimate(keyframe, *right, false).turn.scale_by_turn;
  const double step = 0.2 / v.rig.right.fx;
  for (int axis = 0; axis < 3; ++axis) {
    const auto scale_at = [&](double angle) {
      return optimizer.estimate(keyframe, *right, false, SE3(), SO3::exp(angle * Vec3::Unit(axis)))
          .log_scale;
    };
    // Per pixel; the Gauss-Newton matrix knows nothing of curvature.
    const double difference = (scale_at(step) - scale_at(-step)) / (2 * step) / v.rig.right.fx;
    EXPECT_NEAR(slope[axis] / v.rig.right.fx, difference, 0.002 + 0.1 * std::abs(difference))
        << axis;
  }
}

TEST_P(TurnedCamera, NothingIsFoundInImagesOfOtherThings) {
  const StereoView& v = view(GetParam());
  const StereoView& other = view(GetParam(), 2);
  const auto keyframe = make_keyframe(v, scene(1), {});
  EXPECT_FALSE(
      ScaleOptimizer({}, v.rig).estimate(keyframe, *pyramid_of(other.right), false).turn.valid);
}

TEST_P(TurnedCamera, PointsTurnAsTheRigDoes) {
  const StereoView& v = view(GetParam());
  const auto keyframe = make_keyframe(v, scene(1), {});
  const Vec3 turn(0.01, -0.02, 0.03);
  ScalePoints turned;
  turned.prepare(keyframe, v.rig, SE3(), 0.01);
  turned.turn_right(turn);
  ScalePoints expected;
  expected.prepare(keyframe, v.rig.turned(SO3::exp(turn)), SE3(), 0.01);
  const RightProjection projection(v.rig.right);
  ScaleProjections a;
  ScaleProjections b;
  projection.project(turned, 0.1, 0, &a);
  projection.project(expected, 0.1, 0, &b);
  for (std::size_t i = 0; i < static_cast<std::size_t>(turned.size); ++i) {
    if (b.x[i] < -1e6F) continue;
    ASSERT_NEAR(a.x[i], b.x[i], 2e-3F);
    ASSERT_NEAR(a.y[i], b.y[i], 2e-3F);
  }
}

}  // namespace
}  // namespace sovo
