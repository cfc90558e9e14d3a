#pragma once

#include <optional>
#include <span>
#include <vector>

#include "sovo/vo/lens_fit.h"
#include "sovo/vo/normal_equations.h"
#include "sovo/vo/window.h"

namespace sovo {

/// d (u, v) / d (focal, radial) of where a target sees the centre of a point: its ray leaves the
/// host as much nearer to the axis as it arrives farther from that [px].
Mat2 lens_jacobian(const Window& window, int host, int target, const Point& point);

/// Normal equations of the lens beside those of a window's states: bundle adjustment takes the lens
/// as given ([D] has its four numbers among the states). Residuals of the window as it is are
/// asked, and not the prior, into which those that left were folded with the lens as it was taken.
///
/// A turn by a known angle moves a pixel by that times the focal length, and what is far from the
/// middle by more, so that it is turns about different axes that tell. Where the camera only moves,
/// a world that is stretched along the view looks the same.
class LensEquations {
 public:
  /// `window` must outlive this.
  explicit LensEquations(const Window& window);

  /// Adds the inliers of one point, its depth eliminated. `depth_damping`: added to its H_rho_rho.
  void add(int host, const Point& point, double depth_damping,
           std::span<const TargetResidual> inliers);

  /// Eliminates poses and brightnesses, of which `system` has the normal equations of the same
  /// inliers, without any prior. For residuals of unit noise; nothing where that tells nothing.
  std::optional<LensEvidence> evidence(const NormalEquations& system) const;

 private:
  using Mat82 = Eigen::Matrix<double, 8, 2>;
  /// Of the residuals from a host into a target, in coordinates relative to the latter: J_x^T J_c
  /// and J_x^T r, less what the depths take.
  struct Pair {
    Mat82 cross = Mat82::Zero();
    Vec8 gradient = Vec8::Zero();
    int residuals = 0;
  };
  const Window& window_;
  std::vector<Pair> pairs_;
  Mat2 H_ = Mat2::Zero();
  Vec2 b_ = Vec2::Zero();
};

}  // namespace sovo
