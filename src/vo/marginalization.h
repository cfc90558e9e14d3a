#pragma once

#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/photometric_problem.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Folds the residuals of `points` into the window's prior, their depths eliminated by the Schur
/// complement. Residuals are linearized anew, those that turn out outliers left out, and shifted
/// to the linearization points of the poses, where the prior is expressed. The points stay in the
/// window; the caller removes them.
void marginalize_points(const WindowConfig& config, const std::vector<PointRef>& points,
                        Window* window, WorkerPool* pool);

/// Eliminates keyframe `index` from the prior, its own priors added first, and removes it from
/// the window with all residuals into it. Its points must be gone.
void marginalize_keyframe(const WindowConfig& config, int index, Window* window);

/// Schur complement that eliminates the last `n` variables of H, b (E = x^T H x + 2 b^T x).
/// Directions of the eliminated block without information are left out of its inverse.
void eliminate_last(Eigen::Index n, MatX* H, VecX* b);

}  // namespace sovo
