#include "sovo/vo/normal_equations.h"

namespace sovo {

namespace {

/// Index of (i, j), i <= j, in the upper triangle of a 4x4 matrix stored by rows.
constexpr std::size_t tri(std::size_t i, std::size_t j) { return i * 4 - i * (i + 1) / 2 + j; }

/// J^T J and J^T r of a residual: with D = [du; dv] and the Gram matrix G of (gx, gy, ja, jb), its
/// upper left block is D^T G_gg D.
void add_relative(const LinearizedResidual& r, LaneBlock* sums) {
  const auto& m = r.gram;
  const Lane brightness_u = {0.0F, 0.0F, m[tri(0, 2)], m[tri(0, 3)]};
  const Lane brightness_v = {0.0F, 0.0F, m[tri(1, 2)], m[tri(1, 3)]};
  const Lane brightness_r = {0.0F, 0.0F, r.gram_r[2], r.gram_r[3]};
  const std::array<Lane, 2> du = {load_lane(&r.du[0]), load_lane(&r.du[4])};
  const std::array<Lane, 2> dv = {load_lane(&r.dv[0]), load_lane(&r.dv[4])};
  const std::array<Lane, 2> gu = {m[tri(0, 0)] * du[0] + m[tri(0, 1)] * dv[0],
                                  m[tri(0, 0)] * du[1] + m[tri(0, 1)] * dv[1] + brightness_u};
  const std::array<Lane, 2> gv = {m[tri(0, 1)] * du[0] + m[tri(1, 1)] * dv[0],
                                  m[tri(0, 1)] * du[1] + m[tri(1, 1)] * dv[1] + brightness_v};
  for (std::size_t i = 0; i < 6; ++i) {
    if (i < 4) sums->H[i][0] += r.du[i] * gu[0] + r.dv[i] * gv[0];
    sums->H[i][1] += r.du[i] * gu[1] + r.dv[i] * gv[1];
  }
  sums->H[6][1] += Lane{0.0F, 0.0F, m[tri(2, 2)], m[tri(2, 3)]};
  sums->H[7][1] += Lane{0.0F, 0.0F, 0.0F, m[tri(3, 3)]};
  sums->b[0] += r.gram_r[0] * du[0] + r.gram_r[1] * dv[0];
  sums->b[1] += r.gram_r[0] * du[1] + r.gram_r[1] * dv[1] + brightness_r;
}

/// H += u v^T.
void add_outer_product(const std::array<float, 8>& u, const std::array<float, 8>& v,
                       LaneBlock* sums) {
  const Lane low = load_lane(&v[0]);
  const Lane high = load_lane(&v[4]);
  for (std::size_t i = 0; i < 8; ++i) {
    sums->H[i][0] += u[i] * low;
    sums->H[i][1] += u[i] * high;
  }
}

/// The same sums in double precision.
struct DoubleBlock {
  Mat8 H = Mat8::Zero();
  Vec8 b = Vec8::Zero();
  void add(const LaneBlock& block) {
    for (std::size_t i = 0; i < 8; ++i) {
      for (std::size_t j = 0; j < 8; ++j) {
        H(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) +=
            static_cast<double>(block.H[i][j / kLanes][j % kLanes]);
      }
      b[static_cast<Eigen::Index>(i)] += static_cast<double>(block.b[i / kLanes][i % kLanes]);
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
  const float inverse = has_depth ? static_cast<float>(1.0 / hessian) : 0.0F;
  const auto scaled_gradient = static_cast<float>(gradient);
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const LinearizedResidual& r = residuals[i].linearized;
    if (r.state != ResidualState::kIn) continue;
    ++residuals_;
    add_relative(r, &top_[static_cast<std::size_t>(residuals[i].target)]);
    if (!has_depth) continue;
    alignas(16) std::array<float, 8> scaled;
    for (std::size_t k = 0; k < 8; ++k) scaled[k] = inverse * r.cross[k];
    for (std::size_t j = 0; j <= i; ++j) {
      const LinearizedResidual& other = residuals[j].linearized;
      if (other.state != ResidualState::kIn) continue;
      // Targets ascend: the earlier one is the row.
      add_outer_product(other.cross, scaled,
                        &schur_[index(residuals[j].target, residuals[i].target)]);
    }
    LaneBlock& own = schur_[index(residuals[i].target, residuals[i].target)];
    own.b[0] += scaled_gradient * load_lane(&scaled[0]);
    own.b[1] += scaled_gradient * load_lane(&scaled[4]);
  }
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
