#pragma once

#include <array>
#include <span>

#include "sovo/vo/linearization.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Normal equations of the window's poses and brightnesses, 8 states a keyframe in window order.
///
///        poses     depths
///   [ H_xx (8n)   H_xp     ] [ dx ]     [ b_x ]
///   [ H_xp^T      diag H_pp] [ dp ] = - [ b_p ]
///
/// `top` is H_xx with b_x; `schur` is H_xp H_pp^-1 H_xp^T with H_xp H_pp^-1 b_p.
struct NormalEquations {
  MatX top, schur;
  VecX b_top, b_schur;
  int residuals = 0;
};

/// Points whose own H_rho_rho is less have no depth to eliminate, and none to step.
inline constexpr double kMinDepthHessian = 1e-10;

/// An 8x8 block and an 8-vector in single precision. Of a symmetric block the part below the
/// diagonal means nothing.
struct alignas(32) LaneBlock {
  float H[8][8];
  float b[8];
};

/// Number of the block of two keyframes, a <= b, among those of all pairs.
constexpr std::size_t block_of(int a, int b) {
  return static_cast<std::size_t>(b * (b + 1) / 2 + a);
}

/// A residual of the point being added, into the keyframe with index `target`.
struct TargetResidual {
  int target = 0;
  const LinearizedResidual* linearized = nullptr;
};

/// Sums over a few points of one host, in coordinates relative to each target (pose, a, b of the
/// target while the host stays). Single precision: a run of points is short.
class HostSums {
 public:
  void clear(int num_keyframes);

  /// Adds those residuals of a point that are inliers: J^T J and J^T r of each, and what
  /// eliminating the point's depth takes away.
  void add(std::span<const TargetResidual> residuals, double hessian, double gradient);

  /// J^T J (upper triangle) and J^T r of the residuals into a keyframe.
  const LaneBlock& top(int target) const { return top_[static_cast<std::size_t>(target)]; }
  /// H_xp H_pp^-1 H_xp^T between two targets, a <= b; of a == b also H_xp H_pp^-1 b_p.
  const LaneBlock& schur(int a, int b) const { return schur_[block_of(a, b)]; }
  int residuals() const { return residuals_; }
  int num_keyframes() const { return num_keyframes_; }

 private:
  int num_keyframes_ = 0;
  int residuals_ = 0;
  std::array<LaneBlock, kMaxSlots> top_;
  std::array<LaneBlock, static_cast<std::size_t>(kMaxSlots) * (kMaxSlots + 1) / 2> schur_;
};

/// Adds the sums of a host's runs, in their order and in double precision, to the system:
/// J_target = J, J_host = J * adjoint_host.
void add_host(const Window& window, int host, std::span<const HostSums> runs,
              NormalEquations* system);

/// An empty system of a window's size.
NormalEquations empty_system(const Window& window);

}  // namespace sovo
