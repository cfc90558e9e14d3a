#pragma once

#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// A point and where it lives.
struct PointRef {
  int host = 0;  ///< Index in the window.
  Point* point = nullptr;
};

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

/// All active points of the window, by host, in their order.
std::vector<PointRef> collect_points(Window* window);

/// Accumulates the residuals with state kIn of the points, and sets each point's `hessian` and
/// `gradient`. Work is split into blocks of fixed size that are summed in order.
NormalEquations accumulate(const Window& window, const std::vector<PointRef>& points,
                           WorkerPool* pool);

/// J_rho,x^T of a point over all keyframes, 8n entries, from the `cross` of its residuals.
void depth_row(const Window& window, const PointRef& ref, VecX* row);

/// How many points a block holds.
inline constexpr int kPointBlock = 128;

}  // namespace sovo
