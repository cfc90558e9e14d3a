#include "sovo/vo/normal_equations.h"

#include <gtest/gtest.h>

#include "sovo/image/interpolation.h"
#include "support/numeric.h"
#include "vo/window_test_support.h"

namespace sovo {
namespace {

using namespace test;

using Mat48 = Eigen::Matrix<double, 4, 8>;

/// The sums of a residual's pattern, one pixel after the other in double precision.
struct PlainSums {
  Mat4 gram = Mat4::Zero();
  Vec4 gram_r = Vec4::Zero();
  double rr = 0.0, energy = 0.0;
};

/// Where a pixel of the host is seen in the target.
Vec2 plain_projection(const PairGeometry& g, const Point& point, const Vec2& pixel) {
  const Vec3 p = g.KRKi.cast<double>() * pixel.homogeneous() + g.Kt.cast<double>() * point.rho;
  return p.hnormalized();
}

/// What colour `i` of a point is in the target's image, which is blurred by interpolation and, by
/// what it shows smaller, by the point spread: variances along the host's axes [px^2].
double plain_colour(const PairGeometry& g, const WindowConfig& config, const Point& point,
                    std::size_t i, const Vec2& seen) {
  const Vec2 centre(point.u, point.v);
  const auto move = [&](const Vec2& pixel) { return plain_projection(g, point, pixel); };
  const Mat2 to_host = central_differences<2, 2>(move, centre).inverse();
  const double point_spread = config.point_spread_px * config.point_spread_px;
  const Vec2 f = seen - seen.array().floor().matrix();
  const Vec2 variance = f - f.cwiseAbs2() + Vec2::Constant(point_spread);
  const Vec2 more =
      (to_host.cwiseAbs2() * variance - Vec2::Constant(point_spread)).cwiseMax(0.0).cwiseMin(2.0);
  const auto added = [](double blur, double narrow, double wide) {
    return std::min(blur / 0.5, 1.0) * narrow + std::max((blur - 0.5) / 1.5, 0.0) * wide;
  };
  return point.colour[i] + added(more.x(), point.blur.narrow_u[i], point.blur.wide_u[i]) +
         added(more.y(), point.blur.narrow_v[i], point.blur.wide_v[i]);
}

PlainSums plain_sums(const Window& window, const WindowConfig& config, int host, int target,
                     const Point& point) {
  const PairGeometry& g = window.pair(host, target);
  const double c2 = config.gradient_constant * config.gradient_constant;
  PlainSums out;
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    const Vec2 p = plain_projection(g, point, {point.u + kPattern[i].x, point.v + kPattern[i].y});
    const Sample s = sample_with_gradient(window[target].image(), static_cast<float>(p.x()),
                                          static_cast<float>(p.y()));
    const double gain = g.gain;
    const double colour = plain_colour(g, config, point, i, p);
    const double r = s.value - (gain * colour + g.bias);
    const double huber = std::abs(r) < config.huber ? 1.0 : config.huber / std::abs(r);
    const double gradient = static_cast<double>(s.gx) * s.gx + static_cast<double>(s.gy) * s.gy;
    const double w = 0.5 * (std::sqrt(c2 / (c2 + gradient)) + point.weight[i]);
    const double frozen_gain = g.frozen_gain;
    const Vec4 J(s.gx, s.gy, -frozen_gain * (colour - g.frozen_host_b), -1.0);
    out.gram += huber * w * w * J * J.transpose();
    out.gram_r += huber * w * w * J * r;
    out.rr += huber * w * w * r * r;
    out.energy += huber * w * w * r * r * (2.0 - huber);
  }
  return out;
}

Mat4 gram_of(const LinearizedResidual& r) {
  Mat4 G;
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = i; j < 4; ++j, ++k) G(i, j) = G(j, i) = r.gram[k];
  }
  return G;
}

/// d (u, v, a, b) / d (relative state).
Mat48 state_jacobian(const LinearizedResidual& r) {
  Mat48 D = Mat48::Zero();
  for (std::size_t k = 0; k < 6; ++k) {
    D(0, static_cast<Eigen::Index>(k)) = r.du[k];
    D(1, static_cast<Eigen::Index>(k)) = r.dv[k];
  }
  D(2, 6) = D(3, 7) = 1.0;
  return D;
}

/// Of a depth's Hessian [m^2].
double depth_damping(const WindowConfig& config, const Window& window) {
  return config.depth_damping / std::pow(window.mean_inverse_depth(), 2);
}

/// The normal equations of a window, residual by residual, dense and in double precision.
NormalEquations plain_system(const WindowConfig& config, Window* window) {
  const Eigen::Index n = 8 * window->size();
  const double damping = depth_damping(config, *window);
  NormalEquations out{MatX::Zero(n, n), MatX::Zero(n, n), VecX::Zero(n), VecX::Zero(n), 0};
  for (const PointRef& ref : collect_points(window)) {
    double hessian = 0.0;
    double gradient = 0.0;
    VecX row = VecX::Zero(n);
    for (int t = 0; t < window->size(); ++t) {
      if (t == ref.host) continue;
      LinearizedResidual r;
      linearize(*window, config, ref.host, t, *ref.point, {.state = ResidualState::kIn}, &r);
      if (r.state != ResidualState::kIn) continue;
      Eigen::Matrix<double, 4, Eigen::Dynamic> J(4, n);
      J.setZero();
      J.middleCols<8>(8 * t) = state_jacobian(r);
      J.middleCols<8>(8 * ref.host) = state_jacobian(r) * window->pair(ref.host, t).adjoint_host;
      const Vec4 d_rho(r.du_rho, r.dv_rho, 0.0, 0.0);
      const Vec4 gram_r(r.gram_r[0], r.gram_r[1], r.gram_r[2], r.gram_r[3]);
      const Mat4 G = gram_of(r);
      out.top += J.transpose() * G * J;
      out.b_top += J.transpose() * gram_r;
      row += J.transpose() * (G * d_rho);
      hessian += d_rho.dot(G * d_rho);
      gradient += d_rho.dot(gram_r);
      ++out.residuals;
    }
    if (hessian <= 1e-10) continue;
    out.schur += row * row.transpose() / (hessian + damping);
    out.b_schur += row * gradient / (hessian + damping);
  }
  return out;
}

TEST(Linearization, LanesAgreeWithPlainCode) {
  Window window = scene_window(3, 12);
  displace(1.0, 5, &window);
  const WindowConfig config;
  int compared = 0;
  for (const PointRef& ref : collect_points(&window)) {
    for (int t = 0; t < window.size(); ++t) {
      if (t == ref.host) continue;
      LinearizedResidual r;
      linearize(window, config, ref.host, t, *ref.point, {.state = ResidualState::kIn}, &r);
      if (r.state == ResidualState::kOutOfView) continue;
      const PlainSums plain = plain_sums(window, config, ref.host, t, *ref.point);
      EXPECT_LT(relative_difference(gram_of(r), plain.gram), 1e-4);
      // Positions are rounded to 3e-5 px, so a small residual is not known to 1e-4 of itself.
      const double size = std::sqrt(plain.gram.trace());
      const Vec4 gram_r(r.gram_r[0], r.gram_r[1], r.gram_r[2], r.gram_r[3]);
      EXPECT_LT((gram_r - plain.gram_r).norm(), 1e-4 * size * (std::sqrt(plain.rr) + size));
      EXPECT_NEAR(r.rr, plain.rr, 1e-3 * (plain.rr + 1.0));
      EXPECT_NEAR(r.raw_energy, plain.energy, 1e-3 * (plain.energy + 1.0));
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Linearization, ProjectionThenLinearizationIsTheWhole) {
  Window window = scene_window(3, 12);
  const WindowConfig config;
  const Point& point = window[0].points[0];
  LinearizedResidual whole, halves;
  linearize(window, config, 0, 1, point, {.state = ResidualState::kIn}, &whole);
  PatternProjection projection;
  project_pattern(window, 0, 1, point, &projection);
  prefetch_pattern(window, 1, projection);
  PatternBlur blur;
  linearize_projected(window, config, 0, 1, point, {.state = ResidualState::kIn}, projection, &blur,
                      &halves);
  EXPECT_EQ(halves.gram, whole.gram);
  EXPECT_EQ(halves.cross, whole.cross);
  EXPECT_EQ(halves.energy, whole.energy);
}

TEST(Linearization, TakesABlurThatIsKnown) {
  Window window = scene_window(3, 12);
  window[0].velocity = Vec6::Zero();
  window[1].velocity = (Vec6() << 0.0, 0.0, 0.0, 2.0, -3.0, 0.0).finished();
  window.set_exposures(0.02);
  const WindowConfig config;
  const Point& point = window[0].points[window[0].points.size() / 2];
  PatternProjection projection;
  project_pattern(window, 0, 1, point, &projection);
  const auto with = [&](PatternBlur* blur) {
    LinearizedResidual r;
    linearize_projected(window, config, 0, 1, point, {.state = ResidualState::kIn}, projection,
                        blur, &r);
    return r;
  };
  PatternBlur blur;
  const LinearizedResidual found = with(&blur);
  ASSERT_TRUE(blur.known && blur.in_host);
  EXPECT_EQ(with(&blur).gram, found.gram) << "a second time";
  blur.colours.fill(0.0F);
  EXPECT_NE(with(&blur).gram_r, found.gram_r) << "colours are those of the first time";
  PatternBlur none;
  none.known = true;
  const LinearizedResidual without = with(&none);
  LinearizedResidual sharp;
  window[1].velocity.reset();
  window.set_exposures(0.02);
  linearize(window, config, 0, 1, point, {.state = ResidualState::kIn}, &sharp);
  EXPECT_EQ(without.gram, sharp.gram);
  EXPECT_NE(found.gram_r, sharp.gram_r);
}

TEST(NormalEquations, AgreeWithPlainDoublePrecision) {
  Window window = scene_window(4, 9);
  displace(1.0, 5, &window);
  const WindowConfig config;
  const NormalEquations expected = plain_system(config, &window);
  const NormalEquations found = linearized(config, &window).system;
  EXPECT_EQ(found.residuals, expected.residuals);
  EXPECT_GT(found.residuals, 500);
  // Each state in its own unit, or the translations would hide behind the brightness.
  const VecX unit = expected.top.diagonal().cwiseSqrt().cwiseInverse();
  const auto balanced = [&](const MatX& H) -> MatX {
    return unit.asDiagonal() * H * unit.asDiagonal();
  };
  EXPECT_LT(relative_difference(balanced(found.top), balanced(expected.top)), 1e-5);
  EXPECT_LT(relative_difference(balanced(found.schur), balanced(expected.schur)), 1e-5);
  EXPECT_LT(relative_difference(unit.cwiseProduct(found.b_top).eval(),
                                unit.cwiseProduct(expected.b_top).eval()),
            1e-4);
  EXPECT_LT(relative_difference(unit.cwiseProduct(found.b_schur).eval(),
                                unit.cwiseProduct(expected.b_schur).eval()),
            1e-4);
}

TEST(PhotometricProblem, StepsDepthsAsTheBackSubstitutionSays) {
  Window window = scene_window(3, 12);
  displace(1.0, 5, &window);
  WorkerPool pool(1);
  PhotometricProblem problem(WindowConfig(), collect_points(&window), &window, &pool);
  WindowLinearization at;
  problem.linearize(problem.stored(), {}, &at);
  std::mt19937 random(6);
  VecX dx(24);
  for (double& value : dx) value = 1e-3 * uniform(random, -1.0, 1.0);
  const std::vector<Vec8> relative = relative_displacements(window, dx);
  std::vector<double> expected;
  std::size_t k = 0;
  for (std::size_t i = 0; i < problem.points().size(); ++i) {
    const PointRef& ref = problem.points()[i];
    double b = at.depths[i].gradient;
    for (int n = 0; n < 2; ++n, ++k) {
      const StoredResidual& r = at.residuals[k];
      if (r.state != ResidualState::kIn) continue;
      for (std::size_t s = 0; s < 8; ++s) {
        b += r.cross[s] * relative[static_cast<std::size_t>(ref.host * kMaxSlots + r.target)]
                                  [static_cast<Eigen::Index>(s)];
      }
    }
    const double hessian = at.depths[i].hessian;
    const double damped = hessian + depth_damping(WindowConfig(), window);
    expected.push_back(ref.point->rho - (hessian > 1e-10 ? b / (1.1 * damped) : 0.0));
  }
  problem.step_depths(at, dx, 0.1);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(problem.points()[i].point->rho, expected[i], 1e-5 * std::abs(expected[i]));
  }
}

/// A linearization where each keyframe but the first has moved a little since the last one.
WindowLinearization linearized_after_a_move(double resample_px, double size) {
  Window window = scene_window(3, 12);
  displace(1.0, 5, &window);
  WorkerPool pool(1);
  WindowConfig config;
  config.resample_px = resample_px;
  PhotometricProblem problem(config, collect_points(&window), &window, &pool);
  const WindowLinearization stored = problem.stored();
  WindowLinearization at;
  problem.linearize(stored, {.system = false}, &at);
  std::mt19937 random(7);
  for (int i = 1; i < window.size(); ++i) {
    Vec8 step;
    for (double& value : step) value = size * uniform(random, -1.0, 1.0);
    window[i].set_x(window[i].x + step);
  }
  for (const PointRef& ref : problem.points()) ref.point->rho *= 1.0 + size;
  window.update_geometry();
  problem.linearize(stored, {}, &at);
  return at;
}

TEST(PhotometricProblem, TakesAPatternThatHardlyMovedAlongItsJacobian) {
  const double size = 1e-5;
  const WindowLinearization before = linearized_after_a_move(0.0, 0.0);
  const WindowLinearization sampled = linearized_after_a_move(0.0, size);
  const WindowLinearization moved = linearized_after_a_move(1.0, size);
  double difference = 0.0;
  double change = 0.0;
  for (std::size_t k = 0; k < sampled.residuals.size(); ++k) {
    const StoredResidual& a = sampled.residuals[k];
    const StoredResidual& b = moved.residuals[k];
    ASSERT_EQ(a.state, b.state);
    EXPECT_NEAR(a.centre_u, b.centre_u, 1e-4);
    EXPECT_NEAR(a.centre_v, b.centre_v, 1e-4);
    difference += std::abs(static_cast<double>(a.raw_energy - b.raw_energy));
    change += std::abs(static_cast<double>(a.raw_energy - before.residuals[k].raw_energy));
  }
  EXPECT_GT(change, 0.0);
  EXPECT_LT(difference, 0.2 * change);
  const VecX slope = sampled.system.b_top - before.system.b_top;
  EXPECT_LT((moved.system.b_top - sampled.system.b_top).norm(), 0.2 * slope.norm());
  EXPECT_GT((moved.system.b_top - sampled.system.b_top).norm(), 0.0);  // not sampled again
}

TEST(PhotometricProblem, SamplesAgainWhatMovedFarther) {
  const WindowLinearization sampled = linearized_after_a_move(0.0, 1e-3);
  const WindowLinearization moved = linearized_after_a_move(1e-4, 1e-3);
  EXPECT_EQ(moved.system.b_top, sampled.system.b_top);
  EXPECT_EQ(moved.system.schur, sampled.system.schur);
  EXPECT_EQ(moved.energy, sampled.energy);
}

TEST(PhotometricProblem, ReclassifiesAsAFreshLinearizationWould) {
  Window window = scene_window(3, 12);
  displace(1.0, 5, &window);
  WorkerPool pool(1);
  PhotometricProblem problem(WindowConfig(), collect_points(&window), &window, &pool);
  const WindowLinearization stored = problem.stored();
  WindowLinearization reclassified;
  problem.linearize(stored, {.system = false}, &reclassified);
  int changed = 0;
  for (const double threshold : {20.0, 2000.0}) {
    const WindowLinearization before = reclassified;
    for (int i = 0; i < window.size(); ++i) window[i].outlier_threshold = threshold;
    problem.reclassify(&reclassified);
    WindowLinearization fresh;
    problem.linearize(stored, {.system = false}, &fresh);
    for (std::size_t k = 0; k < fresh.residuals.size(); ++k) {
      EXPECT_EQ(reclassified.residuals[k].state, fresh.residuals[k].state);
      EXPECT_EQ(reclassified.residuals[k].energy, fresh.residuals[k].energy);
      changed += fresh.residuals[k].state != before.residuals[k].state ? 1 : 0;
    }
    for (std::size_t i = 0; i < fresh.depths.size(); ++i) {
      EXPECT_EQ(reclassified.depths[i].hessian, fresh.depths[i].hessian);
      EXPECT_EQ(reclassified.depths[i].gradient, fresh.depths[i].gradient);
    }
  }
  EXPECT_GT(changed, 50);
}

}  // namespace
}  // namespace sovo
