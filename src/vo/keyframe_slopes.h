#pragma once

#include "sovo/vo/window.h"

namespace sovo {

/// Gives the newest keyframe's immature points that stereo matched the slopes of what they lie on
/// (`SurfaceSlopes`), from their own depths and those of the window's points that it sees.
void find_slopes(Window* window);

}  // namespace sovo
