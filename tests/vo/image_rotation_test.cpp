#include "sovo/vo/image_rotation.h"

#include <gtest/gtest.h>

#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

/// A coarse level of an image, in which a pixel is two degrees.
CameraModel coarse_camera() { return test::make_camera(52, 39, 30, 30, 25.5, 19.0); }

class SearchRotation : public ::testing::TestWithParam<Vec3> {};

TEST_P(SearchRotation, FindsATurnOfManyDegrees) {
  const test::SyntheticScene scene(4);
  const CameraModel camera = coarse_camera();
  const SO3 turn = SO3::exp(GetParam());
  const ImageF from = scene.render(camera, SE3());
  ImageF to = scene.render(camera, SE3(turn.inverse(), Vec3::Zero()));
  for (int y = 0; y < to.height(); ++y) {
    for (int x = 0; x < to.width(); ++x) to.at(x, y) = 0.8F * to.at(x, y) + 12.0F;
  }
  const auto found = search_rotation(from, to, camera, SO3(), 0.27);
  ASSERT_TRUE(found);
  EXPECT_LT((*found * turn.inverse()).log().norm(), 0.015);
}

INSTANTIATE_TEST_SUITE_P(Turns, SearchRotation,
                         ::testing::Values(Vec3(0, 0, 0), Vec3(0.2, 0, 0), Vec3(0.05, -0.22, 0.1),
                                           Vec3(-0.15, 0.15, -0.1)));

TEST(SearchRotationAlone, WhatCorrelatesNowhereIsNoTurn) {
  const CameraModel camera = coarse_camera();
  ImageF from(camera.width, camera.height);
  ImageF to(camera.width, camera.height);
  std::mt19937 random(5);
  for (int y = 0; y < from.height(); ++y) {
    for (int x = 0; x < from.width(); ++x) {
      from.at(x, y) = static_cast<float>(test::uniform(random, 0.0, 255.0));
      to.at(x, y) = static_cast<float>(test::uniform(random, 0.0, 255.0));
    }
  }
  EXPECT_FALSE(search_rotation(from, to, camera, SO3(), 0.27));
  from.fill(100.0F);
  EXPECT_FALSE(search_rotation(from, from, camera, SO3(), 0.27)) << "no texture";
}

}  // namespace
}  // namespace sovo
