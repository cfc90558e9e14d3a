#pragma once

#include <optional>

#include "sovo/geometry/se3.h"
#include "sovo/image/image.h"
#include "sovo/vo/brightness.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// What an image of a rolling shutter that was aligned with a level of the reference tells of the
/// camera's turning while it was read out: how its upper rows are turned against the lower ones
/// (one Gauss-Newton step for pose, brightness and turn). `rows`: of level 0. The information is
/// that of unit noise. Nothing where the image cannot tell.
std::optional<ReadoutTurn> measure_row_turn(const ReferenceLevel& level, const ImageF& image,
                                            const SE3& T_current_reference,
                                            const BrightnessTransfer& transfer, double huber,
                                            const RowShift& rows, int halvings);

}  // namespace sovo
