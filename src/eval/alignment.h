#pragma once

#include <span>

#include "sovo/geometry/sim3.h"

namespace sovo {

/// What may be adjusted before an estimate is compared with the truth.
enum class AlignmentKind {
  kRigid,       ///< Rotation and translation.
  kSimilarity,  ///< Rotation, translation and scale.
  kYaw,         ///< Translation and rotation about the truth's vertical (its z axis).
};

/// The motion S that minimizes sum |to_i - S from_i|^2 (Umeyama, "Least-squares estimation of
/// transformation parameters between two point patterns", 1991; Horn 1987 for the rigid case).
/// Where the points leave it open (all in one place, or in one line) the rotation is one of the
/// best ones and the scale is 1 if nothing moves. Precondition: as many points in both.
Sim3 align(std::span<const Vec3> from, std::span<const Vec3> to, AlignmentKind kind);

}  // namespace sovo
