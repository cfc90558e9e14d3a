#pragma once

#include <cstdint>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/so3.h"
#include "sovo/image/pyramid.h"
#include "sovo/vo/patch_alignment.h"

namespace sovo {

struct PatchTrackerConfig {
  int max_tracks = 700;          ///< Patches followed at most, the most corner-like first.
  double min_eigenvalue = 20.0;  ///< Least mean squared gradient in any direction [(grey/px)^2].
  int coarsest_level = 3;        ///< Where the alignment of a patch begins.
  int max_iterations = 10;       ///< A level.
  double min_zncc = 0.8;         ///< Least correlation of a followed patch with its first view.

  template <class Visitor>
  void visit(Visitor& v) {
    v("max_tracks", max_tracks, "patches followed, at most");
    v("min_eigenvalue", min_eigenvalue, "least squared gradient in any direction [(grey/px)^2]");
    v("coarsest_level", coarsest_level, "pyramid level at which the alignment of a patch begins");
    v("max_iterations", max_iterations, "iterations a level, at most");
    v("min_zncc", min_zncc, "least correlation of a followed patch with its first view");
  }
};

/// One patch of the first frame and where it is now.
struct PatchTrack {
  float u0 = 0.F, v0 = 0.F;  ///< In the first frame's level 0 [px].
  float u = 0.F, v = 0.F;  ///< In the newest frame's level 0 [px]; a prediction when not followed.
  bool followed = false;   ///< Whether it was found in the newest frame.
  float zncc = 0.F;        ///< Correlation with the first view.
};

/// Follows square patches of one frame through the next frames by inverse-compositional alignment
/// (Lucas-Kanade; Baker, Matthews 2004). Each patch is compared with its *first* view, turned by
/// the rotation since then, so there is no drift. A lost patch is looked for again where the
/// rotation predicts it.
class PatchTracker {
 public:
  explicit PatchTracker(const PatchTrackerConfig& config = {}) : config_(config) {}

  /// A position of the first frame's level 0.
  struct Position {
    float u, v;
  };

  /// Begins with the most corner-like of `candidates`.
  void set_first(ImagePyramidPtr pyramid, const CameraModel& pinhole,
                 const std::vector<Position>& candidates);

  /// Finds the patches in the next frame. `R_new_last`: rotation since the frame before, which
  /// predicts the positions; `R_new_first`: rotation since the first one, which turns the patches.
  void track(const ImagePyramid& pyramid, const SO3& R_new_last, const SO3& R_new_first);

  const std::vector<PatchTrack>& tracks() const { return tracks_; }
  int num_followed() const;

  /// Contrast of the newest frame relative to the first: median over the patches.
  float gain() const { return gain_; }

 private:
  PatchTrackerConfig config_;
  CameraModel camera_;
  ImagePyramidPtr first_;
  float gain_ = 1.0F;
  std::vector<PatchTrack> tracks_;
  std::vector<float> contrasts_;
};

}  // namespace sovo
