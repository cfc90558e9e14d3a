#pragma once

#include "sovo/driver/sim/ray_batch.h"
#include "sovo/driver/sim/scene_view.h"

namespace sovo::sim {

/// The spots that the pixels of a batch see of a surface: ellipses. Coordinates are relative to
/// places that are known in double precision, so that patterns do not tremble far from the origin.
struct Spots {
  int end = 0;  ///< Where loops over the batch end.

  double foot_x = 0.0, foot_y = 0.0;         ///< On the surface [m]; x and y count from here.
  alignas(32) BatchFloats x, y;              ///< [m]
  alignas(32) BatchFloats long_x, long_y;    ///< The long diameter [m].
  alignas(32) BatchFloats along_x, along_y;  ///< Share of the ray along the surface's axes.
  alignas(32) BatchFloats cosine;            ///< Between ray and normal.
  alignas(32) BatchFloats light;             ///< That falls on them, for cylinders.

  /// Along the world's axes, from the camera [m].
  alignas(32) BatchFloats world_x, world_y, world_z;
  alignas(32) BatchFloats world_long_x, world_long_y;  ///< Zero on what is not level.

  /// A spot is cut into round ones along its long diameter, each looked up at its own resolution.
  alignas(32) std::array<int, kBatch> probes;
  alignas(32) BatchFloats share;      ///< 1 / probes
  alignas(32) BatchFloats log_long;   ///< log2 of the long diameter [m].
  alignas(32) BatchFloats log_probe;  ///< log2 of the diameter of one [m].
};

/// Logarithm to base 2, linear between powers of two.
float log2_linear(float x);

/// What the rays see of the surface. Precondition: `rays` is padded.
void find_spots(const SurfaceView& view, const Surface& surface, const RayBatch& rays, int end,
                Spots* spots);

/// Fills `light` of spots on a cylinder.
void light_cylinder(const SurfaceView& view, const RayBatch& rays, const Eigen::Vector3f& to_sun,
                    float ambient, float sun, Spots* spots);

/// Fills what is along the world's axes.
void turn_to_world(const Mat3& R_world_camera, const Surface& surface, const RayBatch& rays,
                   Spots* spots);

}  // namespace sovo::sim
