#pragma once

#include <span>
#include <vector>

#include "sovo/image/image.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/epipolar_search.h"
#include "sovo/vo/image_cells.h"
#include "sovo/vo/immature_point.h"

namespace sovo {

/// What a point says of whether it moves along with the camera.
enum class CoMovingVote {
  kNone,   ///< Where it was, it may well be seen again, or its look tells nothing.
  kMoves,  ///< Another thing is seen where it was.
  kStays,  ///< It is seen where it was, though by its depth it should have moved.
};

/// The vote of a keyframe's point in a later image. `host`: that keyframe as seen from the image;
/// `nearest`: inverse depth up to which a point whose depth is unknown may lie [1/m]; `rmse`: of
/// what is seen as expected [grey levels].
CoMovingVote co_moving_vote(const CoMovingConfig& config, const ImageF& image,
                            const HostGeometry& host, const ImmaturePoint& point, float nearest,
                            double rmse);

/// The cells of an image in which things are seen that move along with the camera: the vehicle's
/// own body, a vehicle ahead at its own speed. Points vote from keyframe to keyframe; cells in
/// which they stay, again and again, are found. What is found and then shows other things is given
/// up, and all of it when it is more than half of the image.
class CoMovingCells {
 public:
  CoMovingCells(const CoMovingConfig& config, int width, int height);

  const ImageCells& cells() const { return cells_; }
  const ChosenCells& found() const { return found_; }
  bool any() const { return num_found_ > 0; }
  /// Share of the image that was found.
  double share() const;
  /// Whether a place in the image was found [px].
  bool contains(float u, float v) const {
    return any() && cells_.covers(u, v) && found_[cells_.at(u, v)] != 0;
  }

  /// Takes votes of a keyframe's points, as seen from a later image; the rest as there.
  void vote(const ImageF& image, const HostGeometry& host, std::span<const ImmaturePoint> points,
            float nearest, double rmse);
  /// Adds cells at once.
  void add(const ChosenCells& chosen);
  /// Gives up what looks different in the newer of two keyframes, for the third time. `rmse`: of
  /// what is seen as expected [grey levels].
  void compare(const ImageF& before, const ImageF& image, double rmse);

  /// 0 where something was found, and where `base` is 0 (it may be empty: it is so nowhere); of
  /// the image's size.
  ImageU8 mask(const ImageU8& base) const;

 private:
  struct Votes {
    float stays = 0.0F;
    float moves = 0.0F;
    int keyframes = 0;  ///< In which some said that it stays.
    int changed = 0;    ///< Keyframes in which what was found looked different.
  };
  void decide();
  void fill_gaps();
  void clear();

  CoMovingConfig config_;
  ImageCells cells_;
  std::vector<Votes> votes_;
  ChosenCells found_;
  int num_found_ = 0;
};

}  // namespace sovo
