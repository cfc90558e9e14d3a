#pragma once

#include <vector>

#include "sovo/image/pyramid.h"
#include "sovo/image/static_matcher.h"
#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Static matches of a keyframe's pixels, in their order, over the threads of `pool`: some of them,
/// the scouts, first and over the whole range, which tells how near the others need be looked for.
std::vector<StaticMatch> match_pixels(const StaticMatcher& matcher, const ImagePyramid& left,
                                      const ImagePyramid& right,
                                      const std::vector<SelectedPixel>& pixels, WorkerPool* pool);

}  // namespace sovo
