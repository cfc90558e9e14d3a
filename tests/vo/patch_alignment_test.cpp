#include "sovo/vo/patch_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/cameras.h"
#include "support/pyramids.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

/// A texture under an affine map: the view's pixel p shows what is at `A (p - to) + from`,
/// brighter.
struct WarpedTexture {
  std::mt19937 random{11};
  test::ProceduralTexture texture;
  explicit WarpedTexture(double finest_wave) : texture(random, finest_wave, 10.0 * finest_wave) {}

  ImagePyramidPtr view(const Mat2& A, const Vec2& from, const Vec2& to, double gain,
                       double bias) const {
    ImageF image(400, 300);
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const Vec2 p = A * (Vec2(x, y) - to) + from;
        image.at(x, y) = static_cast<float>(gain * texture(p.x(), p.y()) + bias);
      }
    }
    return test::pyramid_of(std::move(image));
  }
};

struct View {
  const char* name;
  double scale;  ///< Of the patch in the second view.
  double turn;   ///< [rad]
};

class FindPatch : public ::testing::TestWithParam<View> {};

TEST_P(FindPatch, FindsItsPlaceUnderScaleTurnAndLight) {
  const WarpedTexture world(12.0);
  const Vec2 from(201.0, 148.0);
  const Vec2 to(187.3, 160.6);
  const double c = std::cos(GetParam().turn);
  const double s = std::sin(GetParam().turn);
  Mat2 warp;
  warp << c, -s, s, c;
  warp *= GetParam().scale;
  const auto first = world.view(Mat2::Identity(), from, from, 1.0, 0.0);
  const auto second = world.view(warp.inverse(), from, to, 0.7, 20.0);
  const PatchWarp w{static_cast<float>(warp(0, 0)), static_cast<float>(warp(0, 1)),
                    static_cast<float>(warp(1, 0)), static_cast<float>(warp(1, 1))};
  for (const Vec2& off : {Vec2(0.3, -0.2), Vec2(4.0, 3.0), Vec2(-6.0, 5.0)}) {
    const PatchMatch match =
        find_patch({first.get(), 201.0F, 148.0F}, *second, w, static_cast<float>(to.x() + off.x()),
                   static_cast<float>(to.y() + off.y()), {});
    ASSERT_TRUE(match.found) << off.transpose();
    EXPECT_LT((Vec2(match.u, match.v) - to).norm(), 0.05 * std::max(1.0, GetParam().scale));
    EXPECT_GT(match.zncc, 0.98F);
    EXPECT_NEAR(match.contrast, 0.7, 0.05);
    EXPECT_EQ(match.finest_level, GetParam().scale > 1.5 ? 1 : 0)
        << "pixels as large as the first's";
  }
}

INSTANTIATE_TEST_SUITE_P(Views, FindPatch,
                         ::testing::Values(View{"Same", 1.0, 0.0}, View{"Turned", 1.0, 0.6},
                                           View{"Larger", 1.9, 0.1}, View{"Smaller", 0.55, -0.2}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(FindPatchAlone, AnotherPlaceOrTheEdgeIsNotFound) {
  const WarpedTexture world(4.0);
  const Vec2 middle(200.0, 150.0);
  const auto first = world.view(Mat2::Identity(), middle, middle, 1.0, 0.0);
  const auto elsewhere = world.view(Mat2::Identity(), Vec2(5200.0, 900.0), middle, 1.0, 0.0);
  int found = 0;
  for (int i = 0; i < 50; ++i) {
    const auto x = static_cast<float>(40 + 6 * i);
    const auto y = static_cast<float>(60 + (37 * i) % 180);
    found += find_patch({first.get(), x, y}, *elsewhere, kNoWarp, x, y, {}).found ? 1 : 0;
  }
  EXPECT_LE(found, 17) << "a third: the texture is smooth";
  EXPECT_FALSE(find_patch({first.get(), 200.0F, 150.0F}, *first, kNoWarp, 1.0F, 150.0F, {}).found);
  EXPECT_FALSE(
      find_patch({first.get(), 399.0F, 150.0F}, *first, kNoWarp, 300.0F, 150.0F, {}).found);
  const PatchWarp folded{0.0F, 1.0F, 0.0F, 1.0F};
  EXPECT_FALSE(find_patch({first.get(), 200.0F, 150.0F}, *first, folded, 200.0F, 150.0F, {}).found);
}

TEST(MakePatch, AnEdgeOrNoiseIsNoPatch) {
  AlignmentPatch patch;
  ImageF edge(40, 40);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) edge.at(x, y) = x < 20 ? 40.0F : 200.0F;
  }
  EXPECT_FALSE(make_patch(edge, 20.0F, 20.0F, kNoWarp, &patch)) << "it slides along the edge";
  ImageF pale(40, 40);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) pale.at(x, y) = 100.0F + static_cast<float>((7 * x + 5 * y) % 3);
  }
  EXPECT_FALSE(make_patch(pale, 20.0F, 20.0F, kNoWarp, &patch)) << "contrast of noise";
}

}  // namespace
}  // namespace sovo
