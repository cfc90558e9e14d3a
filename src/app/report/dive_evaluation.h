#pragma once

#include "sovo/app/report/dive.h"
#include "sovo/eval/evaluation.h"

namespace sovo::app {

/// The odometry of a dive against the truth, and the truth in its frame.
struct DiveEvaluation {
  EvaluationReport report;
  std::vector<Vec3> truth;  ///< Of the base frame, in `odom` by the best rigid motion [m].
  std::uint32_t run = 0;    ///< The one that is compared.
};

/// Compares the metric poses of the longest run, as they were published, with the truth of `files`
/// (its estimate is left alone). Errors name the file, or say why there is nothing to compare.
Result<DiveEvaluation> evaluate_dive(const Dive& whole, const EvaluationFiles& files,
                                     const EvaluationOptions& options);

}  // namespace sovo::app
