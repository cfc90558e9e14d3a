#include "sovo/vo/marginalization.h"

#include <cmath>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/vo/bundle_adjustment.h"

namespace sovo {

namespace {

/// Moves the eight states of keyframe `index` to the end.
void move_to_end(int index, MatX* H, VecX* b) {
  const Eigen::Index n = b->size();
  Eigen::PermutationMatrix<Eigen::Dynamic> permutation(n);
  Eigen::Index to = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool leaves = i / 8 == index;
    permutation.indices()[i] =
        static_cast<int>(leaves ? n - 8 + (i - 8 * static_cast<Eigen::Index>(index)) : to++);
  }
  *H = permutation * *H * permutation.transpose();
  *b = permutation * *b;
}

}  // namespace

void marginalize_points(const WindowConfig& config, const std::vector<PointRef>& points,
                        Window* window, WorkerPool* pool) {
  if (points.empty()) return;
  PhotometricProblem problem(config, points, window, pool);
  WindowLinearization linearized;
  problem.linearize(problem.stored(), {.system = true, .at_frozen_poses = true}, &linearized);
  const NormalEquations& system = linearized.system;
  Prior& prior = window->prior();
  prior.H += config.folding_weight * (system.top - system.schur);
  prior.b += config.folding_weight * (system.b_top - system.b_schur);
}

void marginalize_keyframe(const WindowConfig& config, int index, Window* window) {
  Prior& prior = window->prior();
  const Keyframe& k = (*window)[index];
  const FramePrior own = frame_prior(k, config);
  prior.H.diagonal().segment<8>(8 * index) += own.weight;
  // The prior is expressed at x = 0: the error there is the present one less the displacement.
  prior.b.segment<8>(8 * index) += own.weight.cwiseProduct(own.error - k.x);
  move_to_end(index, &prior.H, &prior.b);
  eliminate_last(8, &prior.H, &prior.b);
  window->erase(index);
}

void eliminate_last(Eigen::Index n, MatX* H, VecX* b) {
  const Eigen::Index keep = b->size() - n;
  // Unit diagonal first: states differ in size by many orders of magnitude.
  const VecX scale = (H->diagonal().array().abs() + 10.0).sqrt();
  const VecX inverse_scale = scale.cwiseInverse();
  const MatX Hs = inverse_scale.asDiagonal() * *H * inverse_scale.asDiagonal();
  const VecX bs = inverse_scale.cwiseProduct(*b);

  const MatX block = Hs.bottomRightCorner(n, n);
  const SymmetricEigen eigen = symmetric_eigen(0.5 * (block + block.transpose()));
  const double cut = 1e-12 * std::max(eigen.values.maxCoeff(), 1e-12);
  VecX inverse = eigen.values;
  for (Eigen::Index i = 0; i < n; ++i) inverse[i] = inverse[i] > cut ? 1.0 / inverse[i] : 0.0;
  const MatX block_inverse = eigen.vectors * inverse.asDiagonal() * eigen.vectors.transpose();

  const MatX gain = Hs.topRightCorner(keep, n) * block_inverse;
  MatX reduced = Hs.topLeftCorner(keep, keep) - gain * Hs.bottomLeftCorner(n, keep);
  const VecX reduced_b = bs.head(keep) - gain * bs.tail(n);
  reduced = 0.5 * (reduced + reduced.transpose().eval());
  const auto s = scale.head(keep).asDiagonal();
  *H = s * reduced * s;
  *b = scale.head(keep).cwiseProduct(reduced_b);
}

}  // namespace sovo
