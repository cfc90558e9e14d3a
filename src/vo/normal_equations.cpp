#include "sovo/vo/normal_equations.h"

#include <algorithm>

#include "sovo/image/lanes.h"

namespace sovo {

namespace {

/// Index of (i, j), i <= j, in the upper triangle of a 4x4 matrix stored by rows.
constexpr std::size_t tri(std::size_t i, std::size_t j) { return i * 4 - i * (i + 1) / 2 + j; }

/// Of the lanes that hold the last of eight states: those of a and b, zero before them.
SOVO_LANE_FUNCTION Lane brightness_lanes(float a, float b, Lane /*of*/) {
  return Lane{0.0F, 0.0F, a, b};
}
SOVO_LANE_FUNCTION WideLane brightness_lanes(float a, float b, WideLane /*of*/) {
  return WideLane{0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, a, b};
}

/// J^T J and J^T r of a residual: with D = [du; dv] and the Gram matrix G of (gx, gy, ja, jb), its
/// upper left block is D^T G_gg D.
template <class F>
SOVO_LANE_FUNCTION void add_relative(const LinearizedResidual& r, LaneBlock* sums) {
  const auto& m = r.gram;
  for (std::size_t c = 0; c < 8; c += lanes_of<F>) {
    const F du = load_lane<F>(&r.du[c]);
    const F dv = load_lane<F>(&r.dv[c]);
    F gu = m[tri(0, 0)] * du + m[tri(0, 1)] * dv;
    F gv = m[tri(0, 1)] * du + m[tri(1, 1)] * dv;
    F b = r.gram_r[0] * du + r.gram_r[1] * dv;
    if (c + lanes_of<F> == 8) {
      gu += brightness_lanes(m[tri(0, 2)], m[tri(0, 3)], F{});
      gv += brightness_lanes(m[tri(1, 2)], m[tri(1, 3)], F{});
      b += brightness_lanes(r.gram_r[2], r.gram_r[3], F{});
    }
    store_lane(F(load_lane<F>(&sums->b[c]) + b), &sums->b[c]);
    for (std::size_t i = 0; i < std::min<std::size_t>(6, c + lanes_of<F>); ++i) {
      float* row = &sums->H[i][c];
      store_lane(F(load_lane<F>(row) + (r.du[i] * gu + r.dv[i] * gv)), row);
    }
  }
  sums->H[6][6] += m[tri(2, 2)];
  sums->H[6][7] += m[tri(2, 3)];
  sums->H[7][7] += m[tri(3, 3)];
}

/// H += u v^T.
template <class F>
SOVO_LANE_FUNCTION void add_outer_product(const float* u, const float* v, LaneBlock* sums) {
  for (std::size_t c = 0; c < 8; c += lanes_of<F>) {
    const F lanes = load_lane<F>(v + c);
    for (std::size_t i = 0; i < 8; ++i) {
      float* row = &sums->H[i][c];
      store_lane(F(load_lane<F>(row) + u[i] * lanes), row);
    }
  }
}

/// The residuals of a point: those that are inliers, their targets ascending.
struct PointResiduals {
  const TargetResidual* begin;
  const TargetResidual* end;
  bool has_depth;
  float inverse_hessian, gradient;  ///< Of the point's depth.
};

/// Adds a point's residuals to the sums by target and by pair of targets. Returns how many counted.
struct AddPoint {
  template <class F>
  SOVO_LANE_FUNCTION static int run(const PointResiduals& point, LaneBlock* top, LaneBlock* schur) {
    int count = 0;
    for (const TargetResidual* i = point.begin; i != point.end; ++i) {
      const LinearizedResidual& r = *i->linearized;
      if (r.state != ResidualState::kIn) continue;
      ++count;
      add_relative<F>(r, &top[i->target]);
      if (!point.has_depth) continue;
      alignas(32) float scaled[8];
      LaneBlock& own = schur[block_of(i->target, i->target)];
      for (std::size_t c = 0; c < 8; c += lanes_of<F>) {
        const F lanes = point.inverse_hessian * load_lane<F>(&r.cross[c]);
        store_lane(lanes, scaled + c);
        store_lane(F(load_lane<F>(&own.b[c]) + point.gradient * lanes), &own.b[c]);
      }
      for (const TargetResidual* j = point.begin; j <= i; ++j) {
        if (j->linearized->state != ResidualState::kIn) continue;
        // The earlier target is the row.
        add_outer_product<F>(j->linearized->cross.data(), scaled,
                             &schur[block_of(j->target, i->target)]);
      }
    }
    return count;
  }
};

/// The same sums in double precision.
struct DoubleBlock {
  Mat8 H = Mat8::Zero();
  Vec8 b = Vec8::Zero();
  void add(const LaneBlock& block) {
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) +=
            static_cast<double>(block.H[i][j]);
      }
      b[static_cast<Eigen::Index>(i)] += static_cast<double>(block.b[i]);
    }
  }
};

void add_top(const Window& window, int host, std::span<const HostSums> runs,
             NormalEquations* system) {
  for (int t = 0; t < window.size(); ++t) {
    if (t == host) continue;
    DoubleBlock sum;
    for (const HostSums& run : runs) sum.add(run.top(t));
    const Mat8 H = sum.H.selfadjointView<Eigen::Upper>();
    const Mat8& A = window.pair(host, t).adjoint_host;
    const Mat8 HA = H * A;
    MatX& top = system->top;
    top.block<8, 8>(8 * t, 8 * t) += H;
    top.block<8, 8>(8 * t, 8 * host) += HA;
    top.block<8, 8>(8 * host, 8 * t) += HA.transpose();
    top.block<8, 8>(8 * host, 8 * host) += A.transpose() * HA;
    system->b_top.segment<8>(8 * t) += sum.b;
    system->b_top.segment<8>(8 * host) += A.transpose() * sum.b;
  }
}

/// S_ab of the targets as it is; of target and host S_ab A_b; of the host with itself A_a^T S_ab
/// A_b, summed over a and b.
void add_schur(const Window& window, int host, std::span<const HostSums> runs,
               NormalEquations* system) {
  MatX& schur = system->schur;
  for (int a = 0; a < window.size(); ++a) {
    if (a == host) continue;
    const Mat8& A_a = window.pair(host, a).adjoint_host;
    for (int b = a; b < window.size(); ++b) {
      if (b == host) continue;
      DoubleBlock sum;
      for (const HostSums& run : runs) sum.add(run.schur(a, b));
      if (a == b) sum.H = sum.H.selfadjointView<Eigen::Upper>().toDenseMatrix();
      const Mat8& S = sum.H;
      const Mat8 SA = S * window.pair(host, b).adjoint_host;
      const Mat8 ASA = A_a.transpose() * SA;
      schur.block<8, 8>(8 * a, 8 * b) += S;
      schur.block<8, 8>(8 * a, 8 * host) += SA;
      schur.block<8, 8>(8 * host, 8 * a) += SA.transpose();
      schur.block<8, 8>(8 * host, 8 * host) += ASA;
      if (a == b) {
        system->b_schur.segment<8>(8 * a) += sum.b;
        system->b_schur.segment<8>(8 * host) += A_a.transpose() * sum.b;
        continue;
      }
      const Mat8 StA = S.transpose() * A_a;
      schur.block<8, 8>(8 * b, 8 * a) += S.transpose();
      schur.block<8, 8>(8 * b, 8 * host) += StA;
      schur.block<8, 8>(8 * host, 8 * b) += StA.transpose();
      schur.block<8, 8>(8 * host, 8 * host) += ASA.transpose();
    }
  }
}

}  // namespace

void HostSums::clear(int num_keyframes) {
  num_keyframes_ = num_keyframes;
  residuals_ = 0;
  const auto n = static_cast<std::size_t>(num_keyframes);
  std::fill_n(top_.begin(), n, LaneBlock{});
  std::fill_n(schur_.begin(), n * (n + 1) / 2, LaneBlock{});
}

void HostSums::add(std::span<const TargetResidual> residuals, double hessian, double gradient) {
  const bool has_depth = hessian > kMinDepthHessian;
  const PointResiduals point = {
      .begin = residuals.data(),
      .end = residuals.data() + residuals.size(),
      .has_depth = has_depth,
      .inverse_hessian = has_depth ? static_cast<float>(1.0 / hessian) : 0.0F,
      .gradient = static_cast<float>(gradient)};
  residuals_ += run_kernel<AddPoint>(point, top_.data(), schur_.data());
}

void add_host(const Window& window, int host, std::span<const HostSums> runs,
              NormalEquations* system) {
  add_top(window, host, runs, system);
  add_schur(window, host, runs, system);
  for (const HostSums& run : runs) system->residuals += run.residuals();
}

NormalEquations empty_system(const Window& window) {
  const int n = 8 * window.size();
  return {MatX::Zero(n, n), MatX::Zero(n, n), VecX::Zero(n), VecX::Zero(n), 0};
}

}  // namespace sovo
