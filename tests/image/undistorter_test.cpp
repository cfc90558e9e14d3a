#include "sovo/image/undistorter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sovo/image/interpolation.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo {
namespace {

double field_of_view_deg(int size, double focal, double center) {
  return (std::atan((center + 0.5) / focal) + std::atan((size - 0.5 - center) / focal)) * 180.0 /
         M_PI;
}

void expect_covered(const CameraModel& raw, const CameraModel& pinhole) {
  EXPECT_EQ(pinhole.distortion, Distortion::kNone);
  EXPECT_EQ(pinhole.width, raw.width);
  EXPECT_EQ(pinhole.height, raw.height);
  EXPECT_EQ(pinhole.fx, pinhole.fy);
  for (int y = 0; y < pinhole.height; ++y) {
    for (int x = 0; x < pinhole.width; ++x) {
      const auto source = raw.project(*pinhole.unproject(Vec2(x, y)));
      ASSERT_TRUE(source) << x << ", " << y;
      ASSERT_TRUE(raw.contains(*source, -1.0)) << x << ", " << y;
    }
  }
}

TEST(OptimalPinhole, KeepsTheViewOfARadialTangentialCamera) {
  const CameraModel raw = test::euroc_left();
  const CameraModel pinhole = optimal_pinhole(raw, {});
  expect_covered(raw, pinhole);
  EXPECT_GT(pinhole.fx, 0.8 * raw.fx);
  EXPECT_LT(pinhole.fx, 1.1 * raw.fx);
  // A wider view would not be covered: the raw image is touched from inside.
  CameraModel wider = pinhole;
  wider.fx = wider.fy = 0.99 * pinhole.fx;
  int outside = 0;
  for (int x = 0; x < wider.width; ++x) {
    for (const int y : {0, wider.height - 1}) {
      const auto source = raw.project(*wider.unproject(Vec2(x, y)));
      if (!source || !raw.contains(*source)) ++outside;
    }
  }
  EXPECT_GT(outside, 0);
}

TEST(OptimalPinhole, LimitsTheViewOfAFisheye) {
  const CameraModel raw = test::tumvi_left();
  for (const double limit : {100.0, 80.0}) {
    UndistortionConfig config;
    config.max_fov_deg = limit;
    const CameraModel pinhole = optimal_pinhole(raw, config);
    expect_covered(raw, pinhole);
    EXPECT_NEAR(field_of_view_deg(pinhole.width, pinhole.fx, pinhole.cx), limit, 0.01);
    EXPECT_LE(field_of_view_deg(pinhole.height, pinhole.fy, pinhole.cy), limit + 1e-4);
  }
}

TEST(OptimalPinhole, LeavesAPinholeCameraAlone) {
  const CameraModel raw = test::make_camera(64, 48, 50.0, 51.0, 30.0, 25.0);
  const CameraModel pinhole = optimal_pinhole(raw, {});
  EXPECT_EQ(pinhole.fx, raw.fx);
  EXPECT_EQ(pinhole.fy, raw.fy);
  EXPECT_EQ(pinhole.cx, raw.cx);
  EXPECT_TRUE(Undistorter(raw, pinhole).is_identity());
}

TEST(Undistorter, SamplesWhereTheRawCameraProjectsTheRay) {
  for (const CameraModel& raw : {test::euroc_left(), test::tumvi_left()}) {
    const CameraModel pinhole = optimal_pinhole(raw, {});
    // Ramps: bilinear interpolation returns the source position itself.
    ImageF ramp_x(raw.width, raw.height);
    ImageF ramp_y(raw.width, raw.height);
    for (int y = 0; y < raw.height; ++y) {
      for (int x = 0; x < raw.width; ++x) {
        ramp_x.at(x, y) = static_cast<float>(x);
        ramp_y.at(x, y) = static_cast<float>(y);
      }
    }
    const Undistorter undistorter(raw, pinhole);
    ASSERT_FALSE(undistorter.is_identity());
    ImageF at_x;
    ImageF at_y;
    undistorter.apply(ramp_x, &at_x);
    undistorter.apply(ramp_y, &at_y);
    const ImageU8 mask = undistorter.valid_mask({});
    int valid = 0;
    for (int y = 0; y < pinhole.height; ++y) {
      for (int x = 0; x < pinhole.width; ++x) {
        if (mask.at(x, y) == 0) continue;
        ++valid;
        const Vec2 source = *raw.project(*pinhole.unproject(Vec2(x, y)));
        ASSERT_NEAR(static_cast<double>(at_x.at(x, y)), source.x(), 1e-3);
        ASSERT_NEAR(static_cast<double>(at_y.at(x, y)), source.y(), 1e-3);
        ASSERT_TRUE(raw.contains(source, 0.999));
      }
    }
    EXPECT_GT(valid, 0.97 * pinhole.width * pinhole.height);
  }
}

TEST(Undistorter, PixelsWithoutSourceAreBlackAndMasked) {
  const CameraModel raw = test::euroc_left();
  CameraModel pinhole = optimal_pinhole(raw, {});
  pinhole.fx = pinhole.fy = 0.5 * pinhole.fx;
  const Undistorter undistorter(raw, pinhole);
  ImageF white(raw.width, raw.height);
  white.fill(200.0F);
  ImageF out;
  undistorter.apply(white, &out);
  const ImageU8 mask = undistorter.valid_mask({});
  EXPECT_EQ(out.at(0, 0), 0.0F);
  EXPECT_EQ(mask.at(0, 0), 0);
  EXPECT_EQ(out.at(raw.width / 2, raw.height / 2), 200.0F);
  EXPECT_EQ(mask.at(raw.width / 2, raw.height / 2), 255);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (mask.data()[i] != 0) {
      ASSERT_EQ(out.data()[i], 200.0F);
    }
  }
}

TEST(Undistorter, MaskOfTheRawImageIsCarriedOver) {
  const CameraModel raw = test::euroc_left();
  const CameraModel pinhole = optimal_pinhole(raw, {});
  const Undistorter undistorter(raw, pinhole);
  ImageU8 raw_mask(raw.width, raw.height);
  raw_mask.fill(255);
  for (int y = 100; y < 200; ++y) {
    for (int x = 300; x < 400; ++x) raw_mask.at(x, y) = 0;
  }
  const ImageU8 mask = undistorter.valid_mask(raw_mask);
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const Vec2 p = undistorter.source(x, y);
      const bool hidden = p.x() > 299.0 && p.x() < 400.0 && p.y() > 99.0 && p.y() < 200.0;
      ASSERT_EQ(mask.at(x, y) != 0, raw.contains(p, 1.0) && !hidden) << x << ", " << y;
    }
  }
}

TEST(Undistorter, ReproducesThePinholeViewOfAScene) {
  const test::SyntheticScene scene(3);
  const CameraModel raw = test::euroc_left().downscaled(2);
  const CameraModel pinhole = optimal_pinhole(raw, {});
  const ImageF raw_view = scene.render(raw, SE3());
  const ImageF direct = scene.render(pinhole, SE3());
  const auto mean_error = [&](const CameraModel& assumed) {
    ImageF undistorted;
    Undistorter(assumed, pinhole).apply(raw_view, &undistorted);
    double sum = 0.0;
    for (std::size_t i = 0; i < direct.size(); ++i) {
      sum += std::abs(static_cast<double>(direct.data()[i] - undistorted.data()[i]));
    }
    return sum / static_cast<double>(direct.size());
  };
  // What is left is the smoothing of the interpolation; a quarter of a pixel would show.
  CameraModel shifted = raw;
  shifted.cx += 0.25;
  EXPECT_LT(mean_error(raw), 3.0);
  EXPECT_GT(mean_error(shifted), 1.3 * mean_error(raw));
}

}  // namespace
}  // namespace sovo
