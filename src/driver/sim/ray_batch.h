#pragma once

#include <array>

namespace sovo::sim {

/// Rays that are worked on together come in fours of this many at most.
inline constexpr int kBatch = 128;
/// Loops over a batch run to a multiple of this; what is beyond the last ray repeats it.
inline constexpr int kBatchStep = 8;

using BatchFloats = std::array<float, kBatch>;

/// Rays that meet one surface, or the sky, side by side.
struct RayBatch {
  int count = 0;
  alignas(32) BatchFloats dx, dy, dz;  ///< Unit rays, in the camera's frame.
  alignas(32) BatchFloats range;       ///< Where they meet the surface [m].
  alignas(32) BatchFloats angle;       ///< Between neighbouring pixels [rad].

  /// Repeats the last ray up to a full step; returns where loops end. Precondition: not empty.
  int pad() {
    const int end = (count + kBatchStep - 1) / kBatchStep * kBatchStep;
    for (BatchFloats* values : {&dx, &dy, &dz, &range, &angle}) {
      for (int i = count; i < end; ++i) (*values)[i] = (*values)[count - 1];
    }
    return end;
  }
};

}  // namespace sovo::sim
