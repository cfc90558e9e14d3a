#include "sovo/vo/co_moving_cells.h"

#include <gtest/gtest.h>

#include <functional>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

float ripples(double u, double v) {
  return static_cast<float>(120.0 + 25.0 * std::sin(0.7 * u) + 25.0 * std::cos(0.6 * v + 0.2 * u) +
                            20.0 * std::sin(0.29 * u - 0.41 * v) + 15.0 * std::cos(0.17 * u));
}

float stripes(double u, double /*v*/) {
  return static_cast<float>(120.0 + 50.0 * std::sin(0.7 * u));
}

ImageF sampled(const std::function<float(double, double)>& grey) {
  const CameraModel camera = small_camera();
  ImageF image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) image.at(x, y) = grey(x, y);
  }
  return image;
}

ImmaturePoint point_at(const ImageF& host, float u, float v, float rho_min, float rho_max) {
  ImmaturePoint p;
  EXPECT_TRUE(make_immature_point(host, u, v, 1, PointConfig(), 50.0, &p));
  p.rho_min = rho_min;
  p.rho_max = rho_max;
  return p;
}

HostGeometry seen_after(const SE3& T_camera_host) {
  return host_geometry(small_camera(), T_camera_host, {});
}

/// What is 1 to 2.5 m away moves by 7 to 17 px.
const SE3 kAside(SO3(), Vec3(0.1, 0.0, 0.0));

constexpr double kRmse = 1.0;

CoMovingVote vote_of(const ImageF& image, const SE3& T_camera_host, const ImmaturePoint& p,
                     float nearest = 2.0F, double rmse = kRmse) {
  return co_moving_vote({}, image, seen_after(T_camera_host), p, nearest, rmse);
}

TEST(CoMovingVoteTest, StaysWhatIsTooNearForThat) {
  const ImageF host = sampled(ripples);
  const ImmaturePoint near = point_at(host, 100, 80, 0.4F, 1.0F);
  EXPECT_EQ(vote_of(host, kAside, near), CoMovingVote::kStays);
  // It takes light from elsewhere as the vehicle turns.
  const ImageF brighter = sampled([](double u, double v) { return ripples(u, v) + 12.0F; });
  EXPECT_EQ(vote_of(brighter, kAside, near), CoMovingVote::kStays);
}

TEST(CoMovingVoteTest, NobodyWhoMightBeSeenThereAgain) {
  const ImageF host = sampled(ripples);
  const ImmaturePoint near = point_at(host, 100, 80, 0.4F, 1.0F);
  EXPECT_EQ(vote_of(host, SE3(), near), CoMovingVote::kNone) << "at rest";
  const ImmaturePoint far = point_at(host, 100, 80, 0.0F, 1.0F);
  EXPECT_EQ(vote_of(host, kAside, far), CoMovingVote::kNone) << "it may be far away";
  // A camera that turns to what it passes: at 0.6 / m it keeps its place.
  const SE3 fixating(SO3::exp(Vec3(0.0, -0.06, 0.0)), Vec3(0.1, 0.0, 0.0));
  EXPECT_EQ(vote_of(host, fixating, near), CoMovingVote::kNone);
  ImmaturePoint unknown = point_at(host, 100, 80, 0.0F, 1.0F);
  unknown.rho_max = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(vote_of(host, fixating, unknown), CoMovingVote::kNone);
  EXPECT_EQ(vote_of(host, SE3(SO3::exp(Vec3(0.0, 0.06, 0.0)), Vec3::Zero()), unknown),
            CoMovingVote::kStays)
      << "turned by 10 px, whatever its depth";
}

TEST(CoMovingVoteTest, AnEdgeTellsNothingOfMotionAlongIt) {
  const ImageF host = sampled(stripes);
  const ImmaturePoint p = point_at(host, 100, 80, 0.4F, 1.0F);
  EXPECT_EQ(vote_of(host, SE3(SO3(), Vec3(0.0, 0.1, 0.0)), p), CoMovingVote::kNone);
  EXPECT_EQ(vote_of(host, kAside, p), CoMovingVote::kStays);
}

TEST(CoMovingVoteTest, MovesWhereAnotherThingIsSeen) {
  const ImageF host = sampled(ripples);
  const ImmaturePoint near = point_at(host, 100, 80, 0.4F, 1.0F);
  const ImageF moved = sampled([](double u, double v) { return ripples(u - 5.0, v + 3.0); });
  EXPECT_EQ(vote_of(moved, kAside, near), CoMovingVote::kMoves);
  EXPECT_EQ(vote_of(moved, kAside, near, 2.0F, 30.0), CoMovingVote::kNone) << "may be noise";
  const ImageF pale = sampled([](double u, double v) { return 0.05F * ripples(u, v); });
  EXPECT_EQ(vote_of(pale, kAside, point_at(pale, 100, 80, 0.4F, 1.0F)), CoMovingVote::kNone)
      << "hardly any gradient";
}

TEST(CoMovingVoteTest, MovesWhatIsSeenWhereItsDepthPutsIt) {
  // By so little that its place shows hardly another thing: 0.4 px.
  const SE3 little(SO3(), Vec3(0.0024, 0.0, 0.0));
  const ImageF host = sampled(ripples);
  const ImageF moved = sampled([](double u, double v) { return ripples(u - 0.4, v); });
  EXPECT_EQ(vote_of(moved, little, point_at(host, 100, 80, 0.9F, 1.0F), 2.0F, 0.1),
            CoMovingVote::kMoves);
}

/// A world that moves by 5 px from keyframe to keyframe, and a body in the image's lower part.
class CoMovingCellsTest : public ::testing::Test {
 protected:
  static constexpr int kBodyTop = 112;  ///< A cell begins there.

  CoMovingCellsTest() : cells_({}, small_camera().width, small_camera().height) {
    images_.push_back(image_of(0));
  }

  static ImageF image_of(int keyframe) {
    return sampled([keyframe](double u, double v) {
      return v >= kBodyTop ? ripples(1.3 * u, v) : ripples(u - 5.0 * keyframe, v + 3.0 * keyframe);
    });
  }

  /// Lets points on a grid of a few pixels vote in the next image.
  void next(const ImageF& image, const SE3& motion = kAside) {
    std::vector<ImmaturePoint> points;
    for (int v = 8; v < image.height() - 8; v += 5) {
      for (int u = 8; u < image.width() - 8; u += 5) {
        points.push_back(
            point_at(images_.back(), static_cast<float>(u), static_cast<float>(v), 0.4F, 1.0F));
      }
    }
    cells_.compare(images_.back(), image, kRmse);
    cells_.vote(image, seen_after(motion), points, 2.0F, kRmse);
    images_.push_back(image);
  }

  CoMovingCells cells_;
  std::vector<ImageF> images_;
};

TEST_F(CoMovingCellsTest, FindTheBodyAfterAFewKeyframes) {
  for (int k = 1; k < CoMovingConfig().keyframes; ++k) next(image_of(k));
  EXPECT_FALSE(cells_.any()) << "it might be chance";
  EXPECT_EQ(cells_.share(), 0.0);
  for (int k = 0; k < 3; ++k) next(image_of(CoMovingConfig().keyframes + k));
  for (int v = 4; v < small_camera().height - 12; v += 16) {
    for (int u = 4; u < small_camera().width; u += 16) {
      const bool found = cells_.contains(static_cast<float>(u), static_cast<float>(v));
      EXPECT_EQ(found, v > kBodyTop) << u << " " << v;
    }
  }
  EXPECT_NEAR(cells_.share(), 2.0 / 10.0, 0.01) << "no point lies in the last row";
  ImageU8 base(small_camera().width, small_camera().height);
  base.fill(255);
  base.at(100, 20) = 0;
  const ImageU8 mask = cells_.mask(base);
  EXPECT_EQ(mask.at(100, 20), 0) << "was not allowed before";
  EXPECT_EQ(mask.at(101, 20), 255);
  EXPECT_EQ(mask.at(100, 130), 0);
  EXPECT_EQ(cells_.mask({}).at(100, 20), 255);
  EXPECT_EQ(cells_.mask({}).at(100, 130), 0);
}

TEST_F(CoMovingCellsTest, NothingIsFoundAtRest) {
  for (int k = 0; k < 10; ++k) next(image_of(0), SE3());
  EXPECT_FALSE(cells_.any());
}

TEST_F(CoMovingCellsTest, AWorldThatRepeatsIsNotTheBody) {
  // By half of the steps all is seen again where it was: as many points say that it has moved.
  for (int k = 0; k < 20; ++k) next(image_of(3 * (k / 2)));
  EXPECT_FALSE(cells_.contains(100.0F, 50.0F));
  EXPECT_TRUE(cells_.contains(100.0F, 130.0F));
}

TEST_F(CoMovingCellsTest, WhatShowsOtherThingsIsGivenUp) {
  for (int k = 1; k <= 8; ++k) next(image_of(k));
  ASSERT_TRUE(cells_.contains(100.0F, 130.0F));
  // The arm is drawn in: the world is seen there, too.
  const auto bare = [](int k) {
    return sampled([k](double u, double v) { return ripples(u - 5.0 * k, v + 3.0 * k); });
  };
  const double share = cells_.share();
  next(bare(9));
  next(bare(10));
  EXPECT_EQ(cells_.share(), share) << "twice may be glare";
  next(bare(11));
  EXPECT_LT(cells_.share(), 0.3 * share);
  for (int k = 12; k < 16; ++k) next(bare(k));
  EXPECT_FALSE(cells_.any());
}

TEST_F(CoMovingCellsTest, AtRestTheBodyIsKept) {
  for (int k = 1; k <= 8; ++k) next(image_of(k));
  const double share = cells_.share();
  ASSERT_GT(share, 0.0);
  for (int k = 0; k < 10; ++k) next(image_of(8), SE3());
  EXPECT_EQ(cells_.share(), share);
}

TEST_F(CoMovingCellsTest, FillsGapsOfABodyWithoutTexture) {
  const ImageCells& cells = cells_.cells();
  ChosenCells ring(cells.size(), 0);
  for (const float v : {40.0F, 56.0F, 72.0F}) {
    for (const float u : {40.0F, 56.0F, 72.0F}) ring[cells.at(u, v)] = 1;
  }
  ring[cells.at(56.0F, 56.0F)] = 0;
  cells_.add(ring);
  EXPECT_TRUE(cells_.contains(56.0F, 56.0F));
  EXPECT_NEAR(cells_.share() * static_cast<double>(ring.size()), 9.0, 1e-9);
}

TEST_F(CoMovingCellsTest, CellsCanBeAddedAtOnce) {
  ChosenCells chosen(cells_.cells().size(), 0);
  chosen[cells_.cells().at(40.0F, 40.0F)] = 1;
  cells_.add(chosen);
  cells_.add(chosen);
  EXPECT_TRUE(cells_.contains(47.0F, 47.0F));
  EXPECT_FALSE(cells_.contains(48.0F, 47.0F));
  EXPECT_NEAR(cells_.share() * static_cast<double>(chosen.size()), 1.0, 1e-9);
}

TEST_F(CoMovingCellsTest, MostOfTheImageIsNoBody) {
  ChosenCells chosen(cells_.cells().size(), 0);
  std::fill_n(chosen.begin(), 60, std::uint8_t{1});
  cells_.add(chosen);
  EXPECT_TRUE(cells_.any()) << "60 of 130";
  std::fill_n(chosen.begin(), 70, std::uint8_t{1});
  cells_.add(chosen);
  EXPECT_FALSE(cells_.any());
  EXPECT_FALSE(cells_.contains(20.0F, 20.0F));
}

TEST(ImageCellsTest, KnowThoseAround) {
  const ImageCells cells(16, 64, 64);
  ChosenCells chosen(cells.size(), 0);
  chosen[5] = 1;
  EXPECT_TRUE(cells.beside(0, chosen));
  EXPECT_TRUE(cells.beside(5, chosen));
  EXPECT_TRUE(cells.beside(10, chosen));
  EXPECT_FALSE(cells.beside(11, chosen));
  EXPECT_FALSE(cells.beside(13, chosen));
  EXPECT_EQ(cells.num_around(5, chosen), 0);
  EXPECT_EQ(cells.num_around(0, chosen), 1);
  chosen[1] = 1;
  EXPECT_EQ(cells.num_around(0, chosen), 3) << "1 is at the edge, and there once more";
  EXPECT_EQ(cells.num_around(6, chosen), 2);
}

TEST(ImageCellsTest, CoverTheImageRowByRow) {
  const ImageCells cells(16, 40, 33);
  EXPECT_EQ(cells.columns, 3);
  EXPECT_EQ(cells.rows, 3);
  EXPECT_EQ(cells.at(0.0F, 0.0F), 0U);
  EXPECT_EQ(cells.at(39.0F, 15.9F), 2U);
  EXPECT_EQ(cells.at(39.9F, 32.9F), 8U);
  EXPECT_EQ(cells.at(-1.0F, 50.0F), 6U) << "the nearest";
  EXPECT_EQ(cells.at(1e30F, -1e30F), 2U);
  EXPECT_EQ(cells.left(5), 32);
  EXPECT_EQ(cells.top(5), 16);
}

}  // namespace
}  // namespace sovo
