#pragma once

#include "sovo/vo/pixel_selector.h"

namespace sovo {

/// Coarse-to-fine tracking of every frame against the newest keyframe.
struct TrackerConfig {
  double huber = 9.0;    ///< Of the photometric residual [grey levels].
  double cutoff = 20.0;  ///< Residuals above count a constant and leave the normal equations.
  int max_levels = 6;
  double lost_rmse_factor = 1.5;  ///< A hypothesis below this times the last RMSE is taken,
  /// when more of the reference pixels in view agree, too, or hardly fewer than in the last frame.
  /// Right poses seldom have less, also under blur; wrong ones that fit by chance have up to 0.7.
  double sure_inlier_ratio = 0.8;
  /// Or, whatever the last RMSE was, when with that share of inliers reference and image correlate
  /// more than this. Of wrong poses under blows, after gaps and in races none had more than 0.71.
  double sure_correlation = 0.9;
  double max_rmse = 40.0;         ///< Lost above [grey levels].
  double min_inlier_ratio = 0.5;  ///< Lost below: reference pixels in view that agree.
  /// Or below this, where reference and image correlate more than `few_inliers_correlation`:
  /// sunlit leaves a metre farther on differ in brightness, but still lie where they should. Right
  /// poses among them have 0.6 to 0.8, wrong ones up to 0.6. Not among weak texture.
  double least_inlier_ratio = 0.35;
  double few_inliers_correlation = 0.65;
  /// Lost below: correlation of reference and image. Right poses have 0.6 and more, on real clips
  /// as under blows and after gaps, those taken by chance mostly less; an unrelated image of little
  /// contrast may have small residuals, but no correlation.
  double min_correlation = 0.55;
  /// The same for a pose to which the motion so far led: what hides a third of the reference, as a
  /// lorry that turns does, leaves 0.5.
  double min_correlation_on_way = 0.3;
  /// c of the weight c^2 / (c^2 + |grad I|^2) of a pixel: where the error of a place, times the
  /// gradient, comes to outweigh noise.
  double gradient_constant = 25.0;
  double brightness_prior_a = 100.0;  ///< Weight of a prior on the log-gain to the reference.
  double brightness_prior_b = 0.0;    ///< The same for the bias.

  template <class Visitor>
  void visit(Visitor& v) {
    v("huber", huber, "Huber threshold of the photometric residual [grey levels]");
    v("cutoff", cutoff, "residuals above count a constant [grey levels]");
    v("max_levels", max_levels, "pyramid levels at most");
    v("lost_rmse_factor", lost_rmse_factor, "a motion hypothesis is taken below this x last RMSE");
    v("sure_inlier_ratio", sure_inlier_ratio,
      "and above this share of pixels in view that agree, or little below the last");
    v("sure_correlation", sure_correlation,
      "or, with that share, above this correlation of reference and image, whatever the RMSE");
    v("max_rmse", max_rmse, "tracking is lost above [grey levels]");
    v("min_inlier_ratio", min_inlier_ratio, "tracking is lost below");
    v("least_inlier_ratio", least_inlier_ratio,
      "or below this, where reference and image correlate");
    v("few_inliers_correlation", few_inliers_correlation, "by more than this");
    v("min_correlation", min_correlation, "tracking is lost below");
    v("min_correlation_on_way", min_correlation_on_way,
      "the same for a pose to which the motion so far led");
    v("gradient_constant", gradient_constant,
      "c of a pixel's weight c^2 / (c^2 + |grad|^2) [grey levels/px]");
    v("brightness_prior_a", brightness_prior_a, "weight of the prior on the log-gain");
    v("brightness_prior_b", brightness_prior_b, "weight of the prior on the bias");
  }
};

/// When a frame becomes a keyframe: the weighted sum of the flow since the newest one (in units of
/// 1120 / (width + height)) and the brightness change exceeds 1, or a smaller sum and a residual
/// twice the first one's. A frame that is blurred waits for a sharp one while there is time. The
/// very next frame after a keyframe has to have moved more where the window is full and what is
/// tracked fits.
struct KeyframeConfig {
  double flow_translation = 0.006;
  double flow_total = 0.012;
  double max_translation_flow = 67.0;
  double approach = 4.3;
  double next_frame_score = 1.35;
  double brightness = 2.0;
  double rmse_factor = 2.0;
  double rmse_min_score = 0.13;
  double blurred_sharpness = 0.7;
  double blurred_max_score = 1.3;
  double blurred_min_inlier_ratio = 0.75;
  int max_keyframes = 7;          ///< In the window, the newest included.
  int min_keyframes = 5;          ///< Kept although few of their points remain.
  double min_points_left = 0.05;  ///< A keyframe with a smaller share of its points leaves.
  double max_brightness = 0.7;    ///< |log-gain| to the newest keyframe above which one leaves.

  template <class Visitor>
  void visit(Visitor& v) {
    v("flow_translation", flow_translation, "weight of the flow without rotation");
    v("flow_total", flow_total, "weight of the flow");
    v("max_translation_flow", max_translation_flow,
      "what the translation adds to the flow of a point counts as no more [px of a VGA image]");
    v("approach", approach,
      "weight of the motion along the view, in depths of the points, of which near ones count "
      "more");
    v("next_frame_score", next_frame_score,
      "motion that makes the very next frame after a keyframe one; 1: as any other");
    v("brightness", brightness, "weight of the change of log-gain");
    v("rmse_factor", rmse_factor, "a keyframe is made above this x the first residual");
    v("rmse_min_score", rmse_min_score, "weighted sum below which no residual makes a keyframe");
    v("blurred_sharpness", blurred_sharpness,
      "a frame is blurred below this share of the sharpest lately; 0: never");
    v("blurred_max_score", blurred_max_score,
      "a blurred frame is no keyframe while the next one's motion will weigh less than this");
    v("blurred_min_inlier_ratio", blurred_min_inlier_ratio,
      "and more of its pixels than this share agree");
    v("max_keyframes", max_keyframes, "keyframes in the window, 3 to 8");
    v("min_keyframes", min_keyframes, "kept although few of their points remain");
    v("min_points_left", min_points_left, "share of points below which a keyframe leaves");
    v("max_brightness", max_brightness, "change of log-gain above which a keyframe leaves");
  }
};

/// Immature points: selection, epipolar tracing, activation.
struct PointConfig {
  int active_points = 2000;   ///< In the window.
  int immature_points = 400;  ///< Selected a keyframe.
  double max_search = 0.027;  ///< Of width + height: longest epipolar search.
  double huber = 9.0;
  double outlier_energy = 144.0;  ///< A pixel of the pattern; grey levels squared.
  double min_quality = 3.0;       ///< Second-best over best energy of the search, to be activated.
  double max_interval_px = 8.0;   ///< Search interval at activation.
  double min_interval_px = 1.5;   ///< Below, a point is not traced any more.
  double stereo_interval_sigmas = 3.0;  ///< Half width of the interval that a static match sets.
  bool surface_slopes = true;           ///< Patterns follow the slope of what they lie on.

  template <class Visitor>
  void visit(Visitor& v) {
    v("active_points", active_points, "active points in the window");
    v("immature_points", immature_points, "points selected a keyframe");
    v("max_search", max_search, "longest epipolar search, share of width + height");
    v("huber", huber, "Huber threshold of the search [grey levels]");
    v("outlier_energy", outlier_energy, "energy a pixel above which a search fails");
    v("min_quality", min_quality, "second-best over best energy, to be activated");
    v("max_interval_px", max_interval_px, "search interval at activation, at most [px]");
    v("min_interval_px", min_interval_px, "search interval below which tracing stops [px]");
    v("stereo_interval_sigmas", stereo_interval_sigmas, "half width of a static match's interval");
    v("surface_slopes", surface_slopes,
      "patterns of pixels that stereo knows follow the slope of ground and walls around them");
  }
};

/// Sliding-window photometric bundle adjustment.
struct WindowConfig {
  int max_iterations = 4;
  int min_iterations = 2;
  double huber = 9.0;
  double outlier_threshold = 144.0;  ///< A pixel: start value of the adaptive outlier threshold.
  double gradient_constant = 50.0;   ///< c of the weight c^2 / (c^2 + |grad I|^2).
  double folding_weight = 0.5;  ///< Of marginalized points' Hessians: pattern pixels correlate.
  double damping = 1e-5;
  double depth_damping = 100.0;            ///< Added to H_rho * mean_rho^2 of every point.
  double place_damping = 1e5;              ///< Added to H of every place, by half the mean depth.
  double min_parallax = 2.0;               ///< Below it stereo depths stand against steps [px].
  double stop_threshold = 1.2;             ///< Times the step norms below which iteration stops.
  double resample_px = 0.01;               ///< Motion of a pattern above which it is sampled anew.
  bool equal_blur = true;                  ///< Colours are blurred as the target blurs them.
  double point_spread_px = 0.5;            ///< Standard deviation of a camera's point spread [px].
  double static_weight = 4.0;              ///< Of residuals in a keyframe's own right image.
  double free_static_weight = 1.0;         ///< Of such that leave the scale free; 0: none.
  double prior_a = 1e4;                    ///< Weight of the prior on each frame's log-gain.
  double prior_b = 1.0;                    ///< The same for the bias.
  double min_relative_information = 50.0;  ///< H_rho * mean_rho^2 of a point to be marginalized.
  int min_good_residuals = 3;
  int lens_every = 2;  ///< Keyframes of which one tells of the lens where cameras turn; 0: none.

  template <class Visitor>
  void visit(Visitor& v) {
    v("max_iterations", max_iterations, "of bundle adjustment");
    v("min_iterations", min_iterations, "of bundle adjustment");
    v("huber", huber, "Huber threshold [grey levels]");
    v("outlier_threshold", outlier_threshold, "start of the outlier threshold, energy a pixel");
    v("gradient_constant", gradient_constant, "c of the weight c^2 / (c^2 + |grad|^2)");
    v("folding_weight", folding_weight, "of marginalized points' Hessians");
    v("damping", damping, "smallest Levenberg-Marquardt damping");
    v("depth_damping", depth_damping,
      "added to the information on a point's log-depth: what no parallax shows stays as it is");
    v("place_damping", place_damping,
      "added to the information on a keyframe's place, in half mean depths: one that hardly "
      "anything "
      "places stays");
    v("min_parallax", min_parallax,
      "with less, what a stereo match tells of a point's depth damps its steps [px]");
    v("stop_threshold", stop_threshold, "iteration stops below this x the step thresholds");
    v("resample_px", resample_px,
      "patterns that moved by less since they were sampled are not sampled again [px]; 0: always");
    v("equal_blur", equal_blur,
      "compare patterns as the target's image blurs them where it shows them smaller, and between "
      "its pixels");
    v("point_spread_px", point_spread_px, "standard deviation of a camera's point spread [px]");
    v("static_weight", static_weight,
      "mode stereo: weight of residuals in a keyframe's own right image");
    v("free_static_weight", free_static_weight,
      "mode scale, direct, depth_init stereo: weight of the same residuals, which tell depths "
      "relative to each other and leave the scale to scale optimization; 0: none");
    v("prior_a", prior_a, "weight of the prior on each frame's log-gain");
    v("prior_b", prior_b, "weight of the prior on each frame's bias");
    v("min_relative_information", min_relative_information,
      "information on a point's log-depth needed to marginalize rather than drop it");
    v("min_good_residuals", min_good_residuals, "residuals needed to marginalize a point");
    v("lens_every", lens_every,
      "where the cameras turn, one of so many keyframes tells whether the lens is as calibrated; "
      "0: none does");
  }
};

/// Thresholds on brightness are made for images in which a pixel beside its place is off by tens of
/// grey levels. Where texture is weak, it is hardly off by their noise, and whatever is strong, a
/// shadow that moves with the vehicle, outweighs all that is right: so they come down, linearly in
/// the gradient, a quarter of a reference's pixels having less.
struct WeakTextureConfig {
  double from_gradient = 12.0;  ///< They begin to [grey levels/px],
  double to_gradient = 8.0;     ///< and end [grey levels/px],
  double least_share = 0.25;    ///< at this share,
  double least_rms = 3.0;       ///< or where the cutoff is so many times the RMS of residuals.

  template <class Visitor>
  void visit(Visitor& v) {
    v("from_gradient", from_gradient,
      "thresholds come down where a quarter of the pixels has less gradient [grey levels/px]");
    v("to_gradient", to_gradient, "down to this one [grey levels/px]");
    v("least_share", least_share, "where this share is left of them; 1: they never do");
    v("least_rms", least_rms, "and where the cutoff is this x the RMS of the residuals");
  }
};

/// What moves along with the camera (its vehicle's body, dirt on the lens, a lorry ahead) is found
/// in squares of the image, where points that are too near to stay in their place do, and left out.
struct CoMovingConfig {
  bool enable = true;
  int cell = 16;              ///< Side of a square [px].
  double min_gradient = 2.0;  ///< Of a point that has a vote [grey levels/px].
  /// Displacement along the gradient that a point in its place should have [px].
  double min_displacement = 2.0;
  /// Share of the difference at its place from that where its depth puts it, below which it stays;
  /// the other way round it has moved.
  double better_match = 0.6;
  /// Differences over the gradient: as much as a displacement by this brings [px].
  double stays_below = 0.35;
  double moves_above = 0.8;
  double majority = 3.0;  ///< Votes that a square stays for each that it moves.
  int keyframes = 4;      ///< In which it stayed.

  template <class Visitor>
  void visit(Visitor& v) {
    v("enable", enable, "leave out what moves along with the camera");
    v("cell", cell, "side of the squares in which that is found [px]");
    v("min_gradient", min_gradient, "of a point that has a vote [grey levels/px]");
    v("min_displacement", min_displacement,
      "along its gradient, that a point which stays in place should have had [px]");
    v("better_match", better_match,
      "it stays when it differs there less than this x what it does where its depth puts it");
    v("stays_below", stays_below,
      "it stays when it changes less than by such a displacement would [px]");
    v("moves_above", moves_above, "and has moved when it changes by more [px]");
    v("majority", majority, "votes that a square stays for each that it moves");
    v("keyframes", keyframes, "keyframes in which a square stayed before it is left out");
  }
};

/// What was exposed while the camera moved is blurred. Photometric residuals between two keyframes
/// compare a pattern as both would show it if each were blurred as the other one is, too.
struct MotionBlurConfig {
  bool enable = true;
  /// Where no exposure time is given it is the one with the least residuals, if these come down
  /// below this share of what they are without blur.
  double least_share = 0.85;

  template <class Visitor>
  void visit(Visitor& v) {
    v("enable", enable, "make up for different motion blur in different keyframes");
    v("least_share", least_share,
      "an unknown exposure time is estimated where that brings residuals below this share of what "
      "they are without; 0: never");
  }
};

/// The vignette of a camera whose calibration has none.
struct VignetteConfig {
  bool estimate = true;

  template <class Visitor>
  void visit(Visitor& v) {
    v("estimate", estimate, "find it out while flying, where the calibration has none");
  }
};

struct DirectConfig {
  TrackerConfig tracker;
  KeyframeConfig keyframe;
  PixelSelectorConfig selection;
  PointConfig points;
  WindowConfig window;
  WeakTextureConfig weak_texture;
  CoMovingConfig co_moving;
  MotionBlurConfig motion_blur;
  VignetteConfig vignette;

  template <class Visitor>
  void visit(Visitor& v) {
    v("tracker", tracker, "tracking of every frame");
    v("keyframe", keyframe, "keyframe decision and window size");
    v("selection", selection, "choice of the pixels that become points");
    v("points", points, "immature points");
    v("window", window, "bundle adjustment");
    v("weak_texture", weak_texture, "thresholds on brightness of images with little texture");
    v("co_moving", co_moving, "what moves along with the camera");
    v("motion_blur", motion_blur, "motion blur that keyframes do not share");
    v("vignette", vignette, "loss of light towards the corners");
  }
};

}  // namespace sovo
