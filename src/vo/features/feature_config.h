#pragma once

namespace sovo {

/// Corners that are followed, and what is made of them.
struct FeatureConfig {
  int features = 700;              ///< Followed from the newest keyframe, at most.
  double min_corner = 10.0;        ///< Least response of a corner [(grey levels / px)^2].
  double weak_corner = 0.5;        ///< As far as that sinks where there is little texture.
  int levels = 4;                  ///< Pyramid levels of a patch.
  int max_iterations = 10;         ///< Of its alignment, a level.
  double min_zncc = 0.6;           ///< Least correlation of a followed patch with its first view.
  double sigma_px = 0.3;           ///< Standard deviation of a followed position [px].
  double outlier_sigmas = 3.0;     ///< Residuals beyond are outliers.
  int min_inliers = 30;            ///< Lost with fewer features that agree,
  double min_inlier_ratio = 0.18;  ///< or with a smaller share of those in view.
  double sure_inlier_ratio = 0.6;  ///< With a smaller one other motions are tried.
  double min_followed = 0.6;       ///< Share of the features below which a keyframe is made.
  int max_keyframes = 12;          ///< In the window, the newest included.
  int free_keyframes = 7;          ///< The newest ones, whose poses bundle adjustment changes.
  int max_iterations_window = 5;   ///< Of bundle adjustment.
  double depth_damping = 4.0;      ///< Added to the information on a feature's log-depth.
  double min_parallax = 2.0;       ///< Below it stereo depths stand against steps [px].

  template <class Visitor>
  void visit(Visitor& v) {
    v("features", features, "corners followed, at most");
    v("min_corner", min_corner, "least response of a corner [(grey levels / px)^2]");
    v("weak_corner", weak_corner, "least of that, with little texture");
    v("levels", levels, "pyramid levels of a patch");
    v("max_iterations", max_iterations, "of the alignment of a patch, a level");
    v("min_zncc", min_zncc, "least correlation of a followed patch with its first view");
    v("sigma_px", sigma_px, "standard deviation of a followed position [px]");
    v("outlier_sigmas", outlier_sigmas, "residuals beyond are outliers");
    v("min_inliers", min_inliers, "tracking is lost with fewer features that agree");
    v("min_inlier_ratio", min_inlier_ratio, "or with a smaller share of those in view");
    v("sure_inlier_ratio", sure_inlier_ratio, "with a smaller one other motions are tried");
    v("min_followed", min_followed, "share of the features below which a keyframe is made");
    v("max_keyframes", max_keyframes, "keyframes in the window");
    v("free_keyframes", free_keyframes, "newest ones, whose poses bundle adjustment changes");
    v("max_iterations_window", max_iterations_window, "of bundle adjustment");
    v("depth_damping", depth_damping,
      "added to the information on a feature's log-depth: what no parallax shows stays as it is");
    v("min_parallax", min_parallax,
      "with less, what a stereo match tells of a depth damps its steps [px]");
  }
};

}  // namespace sovo
