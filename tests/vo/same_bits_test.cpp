#include "support/same_bits.h"

#include <gtest/gtest.h>

#include "sovo/vo/coarse_tracker.h"
#include "sovo/vo/normal_equations.h"
#include "sovo/vo/pattern_kernels.h"
#include "sovo/vo/tracking_kernels.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

/// The small camera's view of nothing in particular.
ImageF noise_view(unsigned seed) {
  const CameraModel camera = small_camera();
  return blurred(noise_image(camera.width, camera.height, seed));
}

/// A small motion, made without sine and cosine.
SE3 plain_pose(int i) {
  const double s = i;
  return {SO3(Eigen::Quaterniond(1.0, 0.004 * s, -0.007 * s, 0.003 * s)),
          Vec3(0.06 * s, -0.02 * s, 0.03 * s)};
}

Window noise_window() {
  Window window(small_camera());
  for (int i = 0; i < 3; ++i) {
    Keyframe& k = window.insert(make_keyframe(
        static_cast<std::uint32_t>(i), pyramid_of(noise_view(4)), plain_pose(i), {0.0, 1.5 * i}));
    for (int v = 20; v < 136; v += 9) {
      for (int u = 20; u < 188; u += 11) {
        k.points.push_back(make_point(k.image(), u, v, 0.25 + 0.001 * (u + v)));
      }
    }
  }
  window.update_geometry();
  return window;
}

/// Of a symmetric block the upper part.
void add_block(const LaneBlock& block, bool symmetric, Checksum* sum) {
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = symmetric ? i : 0; j < 8; ++j) sum->add(block.H[i][j]);
    sum->add(block.b[i]);
  }
}

TEST(SameBits, LinearizationAndItsSums) {
  const Window window = noise_window();
  Checksum residual_sum;
  HostSums sums;
  sums.clear(window.size());
  for (const Point& point : window[0].points) {
    std::array<LinearizedResidual, kMaxSlots> linearized;
    std::vector<TargetResidual> residuals;
    DepthPart depth;
    for (int target = 1; target < window.size(); ++target) {
      LinearizedResidual& r = linearized[static_cast<std::size_t>(target)];
      residual_sum.add(linearize(window, {}, 0, target, point, {.state = ResidualState::kIn}, &r));
      if (r.state == ResidualState::kOutOfView) continue;
      residual_sum.add(std::span(r.gram));
      residual_sum.add(std::span(r.gram_r));
      residual_sum.add(std::span(r.du));
      residual_sum.add(std::span(r.dv));
      residual_sum.add(std::span(r.cross));
      depth.hessian += depth_part(r).hessian;
      depth.gradient += depth_part(r).gradient;
      residuals.push_back({target, &r});
    }
    sums.add(residuals, static_cast<double>(depth.hessian), static_cast<double>(depth.gradient));
  }
  EXPECT_GT(sums.residuals(), 300);
  EXPECT_EQ(residual_sum.value(), 0x2e0b104ee4963a5fU);
  Checksum block_sum;
  for (int b = 1; b < window.size(); ++b) {
    add_block(sums.top(b), true, &block_sum);
    for (int a = 1; a <= b; ++a) add_block(sums.schur(a, b), a == b, &block_sum);
  }
  EXPECT_EQ(block_sum.value(), 0xdf2b388db85200b0U);
}

/// The same where the keyframes' motion blurred them differently.
TEST(SameBits, LinearizationOfBlurredKeyframes) {
  Window window = noise_window();
  for (int i = 0; i < window.size(); ++i) {
    const double s = i;
    window[i].velocity = (Vec6() << 0.0, 0.0, 0.0, 4.0 - 3.0 * s, 1.0 + 2.0 * s, 0.5).finished();
  }
  window.set_exposures(0.015);
  Checksum sum;
  int blurred = 0;
  for (const Point& point : window[0].points) {
    for (int target = 1; target < window.size(); ++target) {
      LinearizedResidual sharp, r;
      const Residual in{.state = ResidualState::kIn};
      sum.add(linearize(window, {}, 0, target, point, in, &r));
      sum.add(std::span(r.gram));
      sum.add(std::span(r.gram_r));
      const auto velocity = std::exchange(window[target].velocity, std::nullopt);
      window.set_exposures(0.015);
      linearize(window, {}, 0, target, point, in, &sharp);
      blurred += r.rr != sharp.rr ? 1 : 0;
      window[target].velocity = velocity;
      window.set_exposures(0.015);
    }
  }
  EXPECT_GT(blurred, 250);
  EXPECT_EQ(sum.value(), 0x8fae568166c439aaU);
}

/// Pixels of an image as reference points, some of which a motion moves out of view.
ReferenceLevel noise_level(const ImageF& image) {
  ReferenceLevel level;
  level.camera = small_camera();
  std::mt19937 random(4);
  for (int i = 0; i < 1003; ++i) {
    const int u = static_cast<int>(random() % static_cast<unsigned>(image.width()));
    const int v = static_cast<int>(random() % static_cast<unsigned>(image.height()));
    level.u.push_back(static_cast<float>(u));
    level.v.push_back(static_cast<float>(v));
    level.rho.push_back(static_cast<float>(random() % 1000U) / 1000.0F);
    level.colour.push_back(image.at(u, v));
    level.weight.push_back(0.5F + static_cast<float>(random() % 1000U) / 1000.0F);
  }
  return level;
}

TEST(SameBits, TrackersNormalEquations) {
  const ImageF image = noise_view(4);
  TrackingReference reference;
  reference.levels = {noise_level(image)};
  CoarseTracker tracker({});
  const auto found =
      tracker.linearize(reference, 0, image, plain_pose(1), {1.01, -2.0}, {9.0, 20.0});
  EXPECT_GT(found.inliers, 300);
  EXPECT_LT(found.inliers, found.in_view);
  Checksum sum;
  for (Eigen::Index i = 0; i < 8; ++i) {
    for (Eigen::Index j = 0; j < 8; ++j) sum.add(found.H(i, j));
    sum.add(found.b[i]);
  }
  sum.add(found.energy);
  EXPECT_EQ(sum.value(), 0x20bb29c69a805675U);
}

/// Everything that the tracker's kernels give, in lanes of one kind.
template <class Residuals, class Gram>
Checksum tracked(const ImageF& image, const Residuals& residuals, const Gram& gram) {
  const ReferenceLevel level = noise_level(image);
  WarpedPoints warped;
  warped.reserve(level.size() + kTrackedGroup);
  ResidualSums sums;
  residuals(TrackedPoints{level, image, Warp(level.camera, plain_pose(1))},
            ResidualConfig{1.01F, -2.0F, 9.0F, 20.0F}, warped.arrays(), &sums);
  std::array<double, kGram> total{};
  gram(warped.arrays(), sums.n, BrightnessJacobian{1.01F, 0.5F}, total.data());
  Checksum sum;
  sum.add(sums.energy);
  sum.add(sums.in_view);
  sum.add(sums.inliers);
  sum.add(std::span(total));
  for (const auto* v : {&warped.x, &warped.gx, &warped.residual, &warped.weight}) {
    sum.add(std::span(v->data(), sums.n));
  }
  return sum;
}

TEST(SameBits, TrackerInEveryKindOfLanes) {
  if (!has_wide_lanes()) GTEST_SKIP() << "this processor has no registers of eight lanes";
  const ImageF image = noise_view(4);
  const auto four = tracked(
      image, [](const auto&... args) { run_narrow<ResidualPass>(args...); },
      [](const auto&... args) { run_narrow<GramOfInliers>(args...); });
  const auto eight = tracked(
      image, [](const auto&... args) { run_wide<ResidualPass>(args...); },
      [](const auto&... args) { run_wide<GramOfInliers>(args...); });
  EXPECT_EQ(four.value(), eight.value());
  if (!has_avx512()) return;
  const auto avx512 = tracked(
      image, [](const auto&... args) { run_avx512<ResidualPass>(args...); },
      [](const auto&... args) { run_avx512<GramOfInliers>(args...); });
  EXPECT_EQ(four.value(), avx512.value());
}

/// Everything that the kernels of a smeared pattern give, in lanes of one kind; zeros beside the
/// image.
using Smeared = std::array<float, 16 + kPatternSize>;
template <class Run>
Smeared smeared(const ImageF& image, const PatternWarp& warp, const Smear& smear,
                const PatternInput& in, const Run& run) {
  alignas(32) Smeared out{};
  SmearedPattern pattern;
  const bool inside = run(SmearPattern(), image, warp, smear, &pattern);
  if (inside) run(SumSmearedPattern(), in, pattern, out.data());
  run(SmearColours(), image, warp.centre[0], warp.centre[1], smear, &out[16]);
  return out;
}

TEST(SameBits, PatternsInEveryKindOfLanes) {
  if (!has_wide_lanes()) GTEST_SKIP() << "this processor has no registers of eight lanes";
  const ImageF image = noise_view(4);
  std::mt19937 random(9);
  const auto draw = [&](int from, int to) {
    return static_cast<float>(from) +
           static_cast<float>(random() % static_cast<unsigned>(64 * (to - from))) / 64.0F;
  };
  int in_view = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const PatternWarp warp = {{draw(-4, image.width() + 4), draw(-4, image.height() + 4), 1.0F},
                              {1.02F, 0.03F, draw(-1, 1) / 64.0F},
                              {-0.05F, 0.97F, 0.001F},
                              image.width(),
                              image.height()};
    alignas(32) std::array<float, 2 * kPatternSize> fx{};
    auto fy = fx;
    std::array<std::int32_t, 2 * kPatternSize> offset{};
    const bool inside = run_narrow<PlacePattern>(warp, &fx[0], &fy[0], &offset[0]);
    EXPECT_EQ(run_wide<PlacePattern>(warp, &fx[8], &fy[8], &offset[8]), inside);
    for (std::size_t i = 0; i < kPatternSize; ++i) {
      EXPECT_EQ(fx[i], fx[i + 8]);
      EXPECT_EQ(fy[i], fy[i + 8]);
      EXPECT_EQ(offset[i], offset[i + 8]);
    }
    if (!inside) continue;
    ++in_view;
    std::array<float, kPatternSize> colour{};
    std::array<float, kPatternSize> weight{};
    for (float& value : colour) value = draw(0, 255);
    for (float& value : weight) value = draw(0, 1);
    ColourBlur blur;
    for (auto* added : {&blur.narrow_u, &blur.narrow_v, &blur.wide_u, &blur.wide_v}) {
      for (float& value : *added) value = draw(-40, 40);
    }
    const PatternInput in = {.image = &image,
                             .offset = &offset[0],
                             .fx = &fx[0],
                             .fy = &fy[0],
                             .colour = &colour[0],
                             .weight = &weight[0],
                             .narrow_u = &blur.narrow_u[0],
                             .narrow_v = &blur.narrow_v[0],
                             .wide_u = &blur.wide_u[0],
                             .wide_v = &blur.wide_v[0],
                             .gain = 1.01F,
                             .bias = -2.0F,
                             .frozen_gain = 1.02F,
                             .frozen_host_b = 3.0F,
                             .huber = 9.0F,
                             .squared_gradient_constant = 2500.0F,
                             .spread = {draw(0, 3), draw(0, 1), draw(0, 1), draw(0, 3)},
                             .point_spread = 0.25F,
                             .most_spread = 2.0F};
    alignas(32) std::array<float, 16> four{};
    auto eight = four;
    run_narrow<SumPattern>(in, four.data());
    run_wide<SumPattern>(in, eight.data());
    EXPECT_EQ(four, eight);
    const Smear smear = {draw(-6, 6), draw(-6, 6), 4};
    const Smeared narrow = smeared(image, warp, smear, in, [](auto kernel, const auto&... args) {
      return run_narrow<decltype(kernel)>(args...);
    });
    EXPECT_EQ(narrow, smeared(image, warp, smear, in, [](auto kernel, const auto&... args) {
                return run_wide<decltype(kernel)>(args...);
              }));
    if (!has_avx512()) continue;
    EXPECT_EQ(narrow, smeared(image, warp, smear, in, [](auto kernel, const auto&... args) {
                return run_avx512<decltype(kernel)>(args...);
              }));
    eight = {};
    run_avx512<SumPattern>(in, eight.data());
    EXPECT_EQ(four, eight);
    EXPECT_TRUE(run_avx512<PlacePattern>(warp, &fx[8], &fy[8], &offset[8]));
    EXPECT_TRUE(std::equal(&offset[0], &offset[8], &offset[8]));
    EXPECT_TRUE(std::equal(&fx[0], &fx[8], &fx[8]) && std::equal(&fy[0], &fy[8], &fy[8]));
  }
  EXPECT_GT(in_view, 200);
}

TEST(SameBits, EpipolarSearch) {
  const ImageF host = noise_view(4);
  HostGeometry geometry;
  geometry.KRKi << 1.01F, -0.02F, 0.7F, 0.015F, 0.99F, -0.4F, 1e-5F, -2e-5F, 1.0F;
  geometry.Kt = {8.0F, -3.0F, 0.02F};
  geometry.gain = 1.02F;
  Checksum sum;
  int good = 0;
  for (int v = 20; v < 136; v += 7) {
    for (int u = 20; u < 188; u += 7) {
      ImmaturePoint p;
      ASSERT_TRUE(
          make_immature_point(host, static_cast<float>(u), static_cast<float>(v), 1, {}, 50.0, &p));
      p.rho_min = 0.01F;
      p.rho_max = 1.5F;
      good += trace(host, geometry, {}, &p) == TraceState::kGood ? 1 : 0;
      sum.add(static_cast<std::uint8_t>(p.state));
      for (const float x : {p.rho_min, p.rho_max, p.quality, p.interval_px}) sum.add(x);
    }
  }
  EXPECT_GT(good, 20);
  EXPECT_EQ(sum.value(), 0xaa398bd83b457571U);
}

}  // namespace
}  // namespace sovo
