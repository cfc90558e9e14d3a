#pragma once

#include "sovo/scale/scale_alignment.h"

namespace sovo {

/// Scale optimization as the paper publishes it (Sec. III-B, eq. 4-6): Gauss-Newton over s with the
/// Huber norm, one pixel a point, all points alike, grey values compared as they are, coarse to
/// fine; a cold start takes the best of several guesses. Unlike the published code a level ends
/// only when the increment is small in either direction.
ScaleEstimate estimate_paper_scale(const ScaleOptimizerConfig& config, const StereoRig& rig,
                                   const KeyframeSnapshot& keyframe, const ImagePyramid& right,
                                   bool cold_start, ScaleWorkspace* workspace);

}  // namespace sovo
