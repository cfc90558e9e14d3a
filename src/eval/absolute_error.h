#pragma once

#include <span>
#include <vector>

#include "sovo/eval/alignment.h"
#include "sovo/eval/statistics.h"

namespace sovo {

/// Absolute trajectory error after an alignment.
struct AbsoluteError {
  AlignmentKind kind = AlignmentKind::kRigid;
  Sim3 S_truth_estimate;       ///< The alignment: estimate's world into truth's.
  std::vector<double> errors;  ///< |t_i - S t_estimate_i| at each pose [m].
  Statistics translation;      ///< Of `errors` [m].
};

/// ATE of poses that run in parallel (camera to world, each in a world of its own).
AbsoluteError absolute_error(std::span<const SE3> truth, std::span<const SE3> estimate,
                             AlignmentKind kind);

/// Rotation errors [rad] at each pose after the best rotation of the estimate's world (least
/// squares on orientations, so a straight or standing trajectory does not spoil it).
std::vector<double> rotation_errors(std::span<const SE3> truth, std::span<const SE3> estimate);

}  // namespace sovo
