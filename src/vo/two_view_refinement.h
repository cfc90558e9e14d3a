#pragma once

#include <array>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/image/pyramid.h"

namespace sovo {

/// Unknowns that all points of two views share.
struct TwoViewState {
  SE3 T_1_0;                ///< First view into second view.
  double a = 1.0, b = 0.0;  ///< Brightness: I_1 = a I_0 + b.
};

/// A point of the first view during refinement.
struct TwoViewPoint {
  float u = 0.F, v = 0.F;     ///< In level 0 of the first view [px].
  float inverse_depth = 1.F;  ///< 1 / z in the first view.
  float expected = 1.F;       ///< Inverse depth that its neighbourhood suggests.
  float energy = 0.F;         ///< Mean robust squared residual of its pattern [grey levels^2].
  float information = 0.F;    ///< Of inverse_depth, from the images alone.
  bool good = true;           ///< In view with all of its pattern.
};

struct TwoViewRefinementConfig {
  double huber = 9.0;             ///< Bound of the quadratic part [grey levels].
  double gradient_weight = 50.0;  ///< c of the weight c^2 / (c^2 + |grad I|^2).
  double expected_sigma = 0.3;    ///< Of ln inverse depth about what the neighbours suggest.
  int max_iterations = 12;        ///< A level.

  template <class Visitor>
  void visit(Visitor& v) {
    v("huber", huber, "bound of the quadratic part of the norm [grey levels]");
    v("gradient_weight", gradient_weight, "c of the weight c^2/(c^2 + |gradient|^2)");
    v("expected_sigma", expected_sigma, "of ln inverse depth about the neighbours' [1]");
    v("max_iterations", max_iterations, "iterations a level");
  }
};

/// One pattern pixel's residual I_1(p') - a I_0(p) - b with its derivatives.
struct TwoViewPixel {
  float residual = 0.F;
  float gradient_squared = 0.F;
  std::array<float, 8> J{};  ///< To translation, rotation (left increments of T_1_0), a, b.
  float J_rho = 0.F;         ///< To the inverse depth.
};

/// Evaluates the residual of pixel (x, y) of a level of the first view at `inverse_depth`; false
/// when it leaves the second view. `camera` is the camera of that level.
bool evaluate_pixel(const ImageF& first, const ImageF& second, const CameraModel& camera,
                    const TwoViewState& state, float x, float y, float inverse_depth,
                    TwoViewPixel* pixel);

/// Photometric adjustment of two views: relative pose (|t| held), brightness and all inverse
/// depths, at levels `coarsest`..0, by Levenberg-Marquardt with the Schur complement on the
/// depths. Points out of view are marked, not removed. Returns the root mean square residual of
/// the last level [grey levels]; infinity without enough points.
double refine_two_views(const ImagePyramid& first, const ImagePyramid& second,
                        const CameraModel& camera, const TwoViewRefinementConfig& config,
                        int coarsest, TwoViewState* state, std::vector<TwoViewPoint>* points);

/// Looks along the epipolar line between the inverse depths `low` and `high`, pixel by pixel, and
/// takes the best match of the pattern at level 0. False when no sample is in view, or when another
/// one away from the best is almost as good.
bool search_inverse_depth(const ImageF& first, const ImageF& second, const CameraModel& camera,
                          const TwoViewState& state, float low, float high, TwoViewPoint* point);

}  // namespace sovo
