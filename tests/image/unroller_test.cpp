#include "sovo/image/unroller.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sovo/geometry/so3.h"
#include "sovo/image/undistorter.h"
#include "support/cameras.h"

namespace sovo {
namespace {

const Vec3 kTurn(0.012, -0.02, 0.015);  // ten degrees a second for a tenth of one

CameraModel raw_camera() {
  return test::make_camera(320, 240, 230, 231, 161.0, 118.0, Distortion::kRadtan,
                           {-0.28, 0.07, 2e-4, 2e-5});
}

/// Grey levels of what is infinitely far away, in long waves.
double far_away(const Vec3& ray) {
  const double x = ray.x() / ray.z();
  const double y = ray.y() / ray.z();
  return 120.0 + 50.0 * std::sin(9.0 * x + 4.0 * y) + 40.0 * std::cos(5.0 * x - 8.0 * y);
}

/// As a rolling shutter shows it whose camera turns by `turn` from the first row to the last one.
ImageF rolled(const CameraModel& camera, const Vec3& turn) {
  ImageF image(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    const double share = static_cast<double>(y) / (camera.height - 1) - 0.5;
    const SO3 R_start_row = SO3::exp(-share * turn);
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = camera.unproject({x, y});
      image.at(x, y) = static_cast<float>(ray ? far_away(R_start_row * *ray) : 0.0);
    }
  }
  return image;
}

/// Greatest difference to what a camera that stands still sees, `border` pixels from the edge.
double worst(const CameraModel& camera, const ImageF& image, int border) {
  double most = 0.0;
  for (int y = border; y < camera.height - border; ++y) {
    for (int x = border; x < camera.width - border; ++x) {
      const double still = far_away(*camera.unproject({x, y}));
      most = std::max(most, std::abs(static_cast<double>(image.at(x, y)) - still));
    }
  }
  return most;
}

TEST(Unroller, ShowsWhatACameraSeesThatStandsStill) {
  const CameraModel raw = raw_camera();
  const CameraModel pinhole = optimal_pinhole(raw, {});
  for (const CameraModel& result : {raw, pinhole}) {
    const Unroller unroller(raw, result);
    Unroller::Lattice lattice;
    ImageF out;
    unroller.apply(rolled(raw, kTurn), kTurn, &lattice, &out);
    EXPECT_LT(worst(result, out, 10), 0.2);
    unroller.apply(rolled(raw, kTurn), Vec3::Zero(), &lattice, &out);
    EXPECT_GT(worst(result, out, 10), 4.0) << "or there is nothing to undo";
    unroller.apply(rolled(raw, Vec3::Zero()), Vec3::Zero(), &lattice, &out);
    EXPECT_LT(worst(result, out, 10), 0.1);
  }
}

TEST(Unroller, WithoutTurningItUndistorts) {
  const CameraModel raw = raw_camera();
  const CameraModel pinhole = optimal_pinhole(raw, {});
  const ImageF image = rolled(raw, kTurn);
  Unroller::Lattice lattice;
  ImageF unrolled, undistorted;
  Unroller(raw, pinhole).apply(image, Vec3::Zero(), &lattice, &unrolled);
  Undistorter(raw, pinhole).apply(image, &undistorted);
  for (int y = 2; y < pinhole.height - 2; ++y) {
    for (int x = 2; x < pinhole.width - 2; ++x) {
      ASSERT_NEAR(unrolled.at(x, y), undistorted.at(x, y), 0.02) << x << " " << y;
    }
  }
}

TEST(Unroller, KnowsWhichRowsItsRowsComeFrom) {
  const CameraModel raw = raw_camera();
  const Unroller same(raw, raw);
  EXPECT_NEAR(same.middle_row(), 0.5 * (raw.height - 1), 1e-3);
  EXPECT_NEAR(same.raw_rows(), 1.0, 1e-5);
  const CameraModel pinhole = optimal_pinhole(raw, {});
  const Unroller unroller(raw, pinhole);
  for (const double y : {20.0, 120.0, 220.0}) {
    const auto source = raw.project(*pinhole.unproject({0.5 * pinhole.width, y}));
    const double row = 0.5 * (raw.height - 1) + unroller.raw_rows() * (y - unroller.middle_row());
    EXPECT_NEAR(row, source->y(), 0.02 * raw.height) << y;
  }
}

TEST(Unroller, ReachIsThatOfThePixelThatMovesMost) {
  const CameraModel camera = test::make_camera(320, 240, 230, 230, 159.5, 119.5);
  const Unroller unroller(camera, camera);
  for (const Vec3& turn : {Vec3(0.02, 0, 0), Vec3(0, 0.02, 0), Vec3(0, 0, 0.02), kTurn}) {
    double most = 0.0;
    for (const double y : {0.0, 239.0}) {
      for (const double x : {0.0, 160.0, 319.0}) {
        const double share = y / 239.0 - 0.5;
        const Vec2 moved = *camera.project(SO3::exp(share * turn) * *camera.unproject({x, y}));
        most = std::max(most, (moved - Vec2(x, y)).norm());
      }
    }
    EXPECT_GE(unroller.reach(turn), 0.95 * most);
    EXPECT_LE(unroller.reach(turn), 1.6 * most);
  }
}

}  // namespace
}  // namespace sovo
