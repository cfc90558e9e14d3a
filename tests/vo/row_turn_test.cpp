#include "sovo/vo/row_turn.h"

#include <gtest/gtest.h>

#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

constexpr double kReadoutS = 0.016;

/// What a rolling shutter shows of the room, whose camera turns at `rate` [rad/s] on the spot.
ImageF rolled_view(const SyntheticScene& scene, const CameraModel& camera,
                   const SE3& T_world_camera, const Vec3& rate, double row_seconds) {
  ImageF image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    const double time = (y - 0.5 * (camera.height - 1)) * row_seconds;
    const SO3 R_world_row = T_world_camera.rotation() * SO3::exp(-time * rate);
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = *camera.unproject({x, y});
      image.at(x, y) =
          static_cast<float>(scene.cast(T_world_camera.translation(), R_world_row * ray).value);
    }
  }
  return image;
}

class RowTurn : public testing::TestWithParam<int> {
 protected:
  RowTurn() : window_(small_camera()) {
    const CameraModel camera = small_camera();
    Keyframe& k = window_.insert(make_keyframe(1, scene_view(scene_, camera, SE3()), SE3()));
    k.points = scene_points(scene_, camera, k.image(), {SE3()}, 0, 4);
    for (Point& p : k.points) p.hessian = 1e4;
    window_.update_geometry();
    reference_ = build_tracking_reference(window_, k.pyramid->num_levels());
    rows_.middle = 0.5 * (camera.height - 1);
    rows_.seconds = kReadoutS / (camera.height - 1);
  }

  /// What the image tells that the camera turned.
  Vec3 measured(const Vec3& rate) {
    const CameraModel camera = small_camera();
    const SE3 pose(SO3::exp(Vec3(0.01, -0.02, 0.01)), Vec3(0.06, -0.02, 0.05));
    const auto pyramid =
        pyramid_of(blurred(rolled_view(scene_, camera, pose, rate, rows_.seconds)));
    const int level = GetParam();
    const auto turn =
        measure_row_turn(reference_.levels[static_cast<std::size_t>(level)], pyramid->level(level),
                         pose.inverse(), {}, 9.0, rows_, level);
    EXPECT_TRUE(turn.has_value());
    if (!turn) return Vec3::Zero();
    EXPECT_GT(turn->information.determinant(), 0.0);
    return turn->rate;
  }

  SyntheticScene scene_{5};
  Window window_;
  TrackingReference reference_;
  RowShift rows_;
};

TEST_P(RowTurn, IsThatOfTheCamera) {
  // One step of Gauss-Newton, at 0.6 rad/s from a pixel away.
  for (const Vec3& rate :
       {Vec3(0.6, 0, 0), Vec3(0, 0.6, 0), Vec3(0, 0, 0.6), Vec3(-0.3, 0.4, -0.5)}) {
    EXPECT_LT((measured(rate) - measured(Vec3::Zero()) - rate).norm(), 0.3 * rate.norm())
        << rate.transpose();
  }
  EXPECT_LT(measured(Vec3::Zero()).norm(), 0.1);
}

INSTANTIATE_TEST_SUITE_P(Levels, RowTurn, testing::Values(0, 1));

TEST(RowTurnWithoutPoints, TellsNothing) {
  ReferenceLevel empty;
  empty.camera = small_camera();
  const ImageF image(empty.camera.width, empty.camera.height);
  EXPECT_FALSE(measure_row_turn(empty, image, SE3(), {}, 9.0, {.seconds = 1e-4}, 0).has_value());
}

}  // namespace
}  // namespace sovo
