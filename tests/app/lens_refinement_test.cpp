#include "sovo/app/lens_refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "support/cameras.h"

namespace sovo::app {
namespace {

StereoRig true_rig() {
  StereoRig rig;
  rig.left = test::make_camera(640, 400, 350, 351, 320, 200);
  rig.right = test::make_camera(640, 400, 352, 353, 322, 201);
  rig.T_right_left = SE3(SO3(), Vec3(-0.12, 0.0, 0.0));
  return rig;
}

StereoRig wrong_rig(const LensChange& left, const LensChange& right) {
  StereoRig rig = true_rig();
  rig.left = with_changed_numbers(rig.left, left);
  rig.right = with_changed_numbers(rig.right, right);
  return rig;
}

/// A recording whose keyframes see shares of what a lens is off, and more of it in the rim where
/// its focal length is wrong, as they do.
struct Recording {
  double seen_focal = 0.4, seen_radial = 0.6;
  LensChange sigma = {1e-4, 1e-4};
  std::vector<double> lengths;  ///< Of the lens that was followed, of every run.

  Result<LensPass> run(const StereoRig& rig, LensSide followed) {
    const bool left = followed == LensSide::kLeft;
    const CameraModel& camera = left ? rig.left : rig.right;
    const CameraModel truth = left ? true_rig().left : true_rig().right;
    lengths.push_back(camera.fx);
    const double focal = std::log(truth.fx / camera.fx);
    const double radial = truth.d[0] - camera.d[0];
    LensPass out;
    out.fit = LensFit{{seen_focal * focal, seen_radial * radial + 0.8 * focal}, sigma};
    return out;
  }

  Result<LensRefinement> refine(const StereoRig& rig, LensSide side, int passes = 12) {
    return refine_lens(rig, side, passes,
                       [this](const StereoRig& r, LensSide followed) { return run(r, followed); });
  }
};

TEST(LensRefinement, FindsTheLensOfTheLeftCameraAndChangesTheRightAlike) {
  Recording recording;
  const auto found = recording.refine(wrong_rig({0.05, -0.02}, {0.05, -0.02}), LensSide::kLeft);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kSettled);
  EXPECT_NEAR(found->rig.left.fx, 350.0, 0.2);
  EXPECT_NEAR(found->rig.left.d[0], 0.0, 1e-3);
  EXPECT_NEAR(found->rig.right.fx, 352.0, 0.2);
  EXPECT_NEAR(found->change.focal, -0.05, 6e-4);
  EXPECT_GT(found->sigma.focal, recording.sigma.focal) << "keyframes see a part of an error only";
  EXPECT_LE(found->passes, 8);
}

TEST(LensRefinement, FindsTheLensOfTheRightCameraAlone) {
  Recording recording;
  const auto found = recording.refine(wrong_rig({}, {-0.04, 0.01}), LensSide::kRight);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kSettled);
  EXPECT_EQ(found->rig.left.fx, 350.0);
  EXPECT_NEAR(found->rig.right.fx, 352.0, 0.2);
}

TEST(LensRefinement, ChangesNothingWhereTheLensFits) {
  Recording recording;
  const auto found = recording.refine(true_rig(), LensSide::kLeft);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kSettled);
  EXPECT_EQ(found->passes, 1);
  EXPECT_EQ(found->rig.left.fx, 350.0);
  ASSERT_EQ(recording.lengths.size(), 2U) << "and one with a wrong focal length";
  EXPECT_NEAR(recording.lengths[1], 350.0 * std::exp(0.01), 1e-3);
}

TEST(LensRefinement, IsNotTakenInByARecordingThatTellsNothing) {
  Recording recording;
  recording.seen_focal = 0.05;  // of a plane that a camera turns above
  recording.sigma.focal = 2e-5;
  const auto found = recording.refine(true_rig(), LensSide::kLeft);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kUntold);
}

TEST(LensRefinement, DoesNotBelieveKeyframesThatScatter) {
  Recording recording;
  recording.sigma.focal = 0.002;
  EXPECT_EQ(recording.refine(true_rig(), LensSide::kLeft)->end, LensSearch::kUntold);
}

TEST(LensRefinement, IsContentWithLessWhereTheLensWasFarOff) {
  Recording recording;
  recording.sigma.focal = 0.002;
  const auto found = recording.refine(wrong_rig({-0.25, 0.0}, {-0.25, 0.0}), LensSide::kLeft, 20);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kSettled);
  EXPECT_NEAR(found->change.focal, 0.25, 0.01);
}

TEST(LensRefinement, SaysWhenItRanOutOfPasses) {
  Recording recording;
  const auto found = recording.refine(wrong_rig({0.2, 0.0}, {0.2, 0.0}), LensSide::kLeft, 2);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->end, LensSearch::kOutOfPasses);
  EXPECT_EQ(found->passes, 2);
}

TEST(LensRefinement, EndsWithTheErrorOfARun) {
  const auto found = refine_lens(
      true_rig(), LensSide::kLeft, 5,
      [](const StereoRig&, LensSide) -> Result<LensPass> { return Error{"the disk is gone"}; });
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.error(), "the disk is gone");
}

}  // namespace
}  // namespace sovo::app
