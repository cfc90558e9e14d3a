#include "sovo/vo/normal_equations.h"

#include <algorithm>
#include <cmath>

#include "sovo/vo/linearization.h"

namespace sovo {

namespace {

/// Sums of one block of points.
struct Block {
  MatX top, schur;
  VecX b_top, b_schur;
  int residuals = 0;
};

/// Relative normal equations of one host into each target, of a run of points with this host.
struct HostSums {
  std::array<Mat8, kMaxSlots> H;
  std::array<Vec8, kMaxSlots> b;
  std::array<bool, kMaxSlots> used;
  void clear() {
    used.fill(false);
    for (auto& m : H) m.setZero();
    for (auto& v : b) v.setZero();
  }
};

/// Turns relative sums into absolute ones: J_target = J, J_host = J * adjoint_host.
void flush(const Window& window, int host, HostSums* sums, Block* block) {
  for (int t = 0; t < window.size(); ++t) {
    const auto k = static_cast<std::size_t>(t);
    if (!sums->used[k]) continue;
    const Mat8 H = sums->H[k].selfadjointView<Eigen::Lower>();
    const Mat8& A = window.pair(host, t).adjoint_host;
    const Mat8 HA = H * A;
    block->top.block<8, 8>(8 * t, 8 * t) += H;
    block->top.block<8, 8>(8 * t, 8 * host) += HA;
    block->top.block<8, 8>(8 * host, 8 * t) += HA.transpose();
    block->top.block<8, 8>(8 * host, 8 * host) += A.transpose() * HA;
    block->b_top.segment<8>(8 * t) += sums->b[k];
    block->b_top.segment<8>(8 * host) += A.transpose() * sums->b[k];
  }
  sums->clear();
}

void accumulate_block(const Window& window, const PointRef* begin, const PointRef* end,
                      Block* block) {
  const int n = 8 * window.size();
  block->top = MatX::Zero(n, n);
  block->schur = MatX::Zero(n, n);
  block->b_top = VecX::Zero(n);
  block->b_schur = VecX::Zero(n);
  const auto count = static_cast<Eigen::Index>(end - begin);
  MatX rows = MatX::Zero(n, count);  // columns: J_rho,x^T / sqrt(H_pp)
  VecX scaled_gradient = VecX::Zero(count);
  HostSums sums;
  sums.clear();
  VecX row(n);
  Eigen::Index column = 0;
  for (const PointRef* ref = begin; ref != end; ++ref, ++column) {
    Point& p = *ref->point;
    p.hessian = 0.0;
    p.gradient = 0.0;
    for (int t = 0; t < window.size(); ++t) {
      const Residual& r = p.residuals[static_cast<std::size_t>(window[t].slot)];
      if (r.state != ResidualState::kIn) continue;
      const auto k = static_cast<std::size_t>(t);
      accumulate_relative(r, &sums.H[k], &sums.b[k]);
      sums.used[k] = true;
      accumulate_depth(r, &p.hessian, &p.gradient);
      ++block->residuals;
    }
    if (p.hessian > 1e-10) {
      depth_row(window, *ref, &row);
      const double s = 1.0 / std::sqrt(p.hessian);
      rows.col(column) = s * row;
      scaled_gradient[column] = s * p.gradient;
    }
    if (ref + 1 == end || (ref + 1)->host != ref->host) flush(window, ref->host, &sums, block);
  }
  block->schur.selfadjointView<Eigen::Lower>().rankUpdate(rows);
  block->b_schur = rows * scaled_gradient;
}

}  // namespace

std::vector<PointRef> collect_points(Window* window) {
  std::vector<PointRef> refs;
  refs.reserve(static_cast<std::size_t>(window->num_active_points()));
  for (int i = 0; i < window->size(); ++i) {
    for (Point& p : (*window)[i].points) refs.push_back({i, &p});
  }
  return refs;
}

void depth_row(const Window& window, const PointRef& ref, VecX* row) {
  row->setZero();
  for (int t = 0; t < window.size(); ++t) {
    const Residual& r = ref.point->residuals[static_cast<std::size_t>(window[t].slot)];
    if (r.state != ResidualState::kIn) continue;
    const Vec8 v = Eigen::Map<const Eigen::Matrix<float, 8, 1>>(r.cross.data()).cast<double>();
    row->segment<8>(8 * t) += v;
    row->segment<8>(8 * ref.host) += window.pair(ref.host, t).adjoint_host.transpose() * v;
  }
}

NormalEquations accumulate(const Window& window, const std::vector<PointRef>& points,
                           WorkerPool* pool) {
  const int total = static_cast<int>(points.size());
  const int num_blocks = (total + kPointBlock - 1) / kPointBlock;
  std::vector<Block> blocks(static_cast<std::size_t>(num_blocks));
  pool->run(num_blocks, [&](int i) {
    const PointRef* first = points.data() + static_cast<std::ptrdiff_t>(i) * kPointBlock;
    const PointRef* last = points.data() + std::min(total, (i + 1) * kPointBlock);
    accumulate_block(window, first, last, &blocks[static_cast<std::size_t>(i)]);
  });

  const int n = 8 * window.size();
  NormalEquations out{MatX::Zero(n, n), MatX::Zero(n, n), VecX::Zero(n), VecX::Zero(n), 0};
  for (const Block& b : blocks) {
    out.top += b.top;
    out.schur += b.schur;
    out.b_top += b.b_top;
    out.b_schur += b.b_schur;
    out.residuals += b.residuals;
  }
  out.schur.triangularView<Eigen::StrictlyUpper>() = out.schur.transpose();
  return out;
}

}  // namespace sovo
