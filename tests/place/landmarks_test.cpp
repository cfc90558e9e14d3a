#include "sovo/place/landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/cameras.h"
#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

constexpr double kBaseline = 0.11;

StereoRig landmark_rig() {
  StereoRig rig;
  rig.left = test::make_camera(320, 240, 250, 252, 158.5, 121.2);
  rig.right = test::make_camera(320, 240, 255, 254, 161.0, 118.3);
  rig.T_right_left = SE3(SO3::exp(Vec3(0.004, -0.003, 0.006)), Vec3(-kBaseline, 0.002, 0));
  return rig;
}

/// What the rig sees from the scene's origin, halved so often.
StereoView view_from_origin(int halvings) {
  static const test::SyntheticScene scene(5);
  StereoRig rig = landmark_rig();
  rig.left = rig.left.at_level(halvings);
  rig.right = rig.right.at_level(halvings);
  StereoView view;
  view.left = test::pyramid_of(scene.render(rig.left, SE3()));
  view.right = test::pyramid_of(scene.render(rig.right, rig.T_right_left.inverse()));
  view.halvings = halvings;
  return view;
}

/// Share of the landmarks with depth whose inverse depth is that of the scene, within three sigma
/// and a fiftieth.
double share_of_right_depths(const std::vector<Landmark>& landmarks, std::size_t* with_depth) {
  const test::SyntheticScene scene(5);
  const CameraModel camera = landmark_rig().left;
  std::size_t right = 0;
  *with_depth = 0;
  for (const Landmark& l : landmarks) {
    if (!l.has_depth()) continue;
    ++*with_depth;
    const Vec3 ray((l.keypoint.u - camera.cx) / camera.fx, (l.keypoint.v - camera.cy) / camera.fy,
                   1.0);
    const double truth = 1.0 / scene.cast(Vec3::Zero(), ray).distance;
    right += std::abs(l.inverse_depth - truth) < 3.0 * l.sigma + 0.02 * truth ? 1 : 0;
  }
  return static_cast<double>(right) / static_cast<double>(std::max<std::size_t>(1, *with_depth));
}

TEST(Landmarks, HaveTheDepthsThatTheRightImageTells) {
  for (const int halvings : {0, 1}) {
    const auto landmarks =
        find_landmarks(view_from_origin(halvings), {}, landmark_rig(), {.per_image = 200});
    std::size_t with_depth = 0;
    EXPECT_GT(share_of_right_depths(landmarks, &with_depth), 0.9) << halvings;
    EXPECT_GT(with_depth, landmarks.size() / 2) << halvings;
    for (const Landmark& l : landmarks) EXPECT_GE(l.keypoint.level, halvings);
  }
}

TEST(Landmarks, OfARightImageOfAnotherInstantToo) {
  const test::SyntheticScene scene(5);
  const StereoRig rig = landmark_rig();
  StereoView view = view_from_origin(0);
  const SE3 T_left_later(SO3::exp(Vec3(0.0, 0.03, 0.0)), Vec3(0.02, 0.0, 0.05));
  view.right = test::pyramid_of(scene.render(rig.right, T_left_later * rig.T_right_left.inverse()));
  view.T_later_left = T_left_later.inverse();
  std::size_t with_depth = 0;
  EXPECT_GT(share_of_right_depths(find_landmarks(view, {}, rig, {.per_image = 200}), &with_depth),
            0.9);
  EXPECT_GT(with_depth, 50U);
}

TEST(Landmarks, AreWhereTheMaskAllowsThem) {
  StereoView view = view_from_origin(1);
  const ImageF& image = view.left->level(0);
  ImageU8 left_half(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      left_half.at(x, y) = 2 * x < image.width() ? 255 : 0;
    }
  }
  view.mask = left_half;
  const auto landmarks = find_landmarks(view, {}, landmark_rig(), {.per_image = 200});
  EXPECT_GT(landmarks.size(), 20U);
  for (const Landmark& l : landmarks) EXPECT_LT(l.keypoint.u, landmark_rig().left.width / 2.0);
}

TEST(Landmarks, MasksAreJoined) {
  ImageU8 a(2, 1);
  ImageU8 b(2, 1);
  a.at(0, 0) = b.at(0, 0) = b.at(1, 0) = 255;
  a.at(1, 0) = 0;
  EXPECT_EQ(both_masks(a, b).at(0, 0), 255);
  EXPECT_EQ(both_masks(a, b).at(1, 0), 0);
  EXPECT_EQ(both_masks(b, a).at(1, 0), 0);
  EXPECT_EQ(both_masks({}, a).at(1, 0), 0);
  EXPECT_EQ(both_masks(a, {}).at(1, 0), 0);
  EXPECT_TRUE(both_masks({}, {}).empty());
}

}  // namespace
}  // namespace sovo
