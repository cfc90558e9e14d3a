#pragma once

#include <array>
#include <cstdint>

#include "sovo/image/pyramid.h"
#include "sovo/vo/image_cells.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// What has changed between two images of a camera that seems to be at rest.
struct ImageChange {
  ImageCells cells;
  ChosenCells same;       ///< That look the same,
  ChosenCells different;  ///< and that show another thing.
  int textured = 0;       ///< Cells that vary by more than noise, in one of the images.

  /// Share of the cells with texture that are different; 0 where they are few.
  double share() const;
};

/// Compares images that were halved once or more, in which what lies a pixel aside looks alike:
/// what haze leaves of the world drowns in the noise of larger ones. `rmse`: residuals of what is
/// as expected in the whole images [grey levels]. `halvings`: from 1 on; at most those that the
/// pyramids have. Precondition: the images are of one size.
ImageChange image_change(const ImagePyramid& before, const ImagePyramid& image, double rmse,
                         int halvings);

/// Whether what is different may be the world.
bool may_deny_rest(const ImageChange& change);

/// Whether a change says that the camera moves, and only what moves along with it looks the same:
/// much is different, and what stays does not lie behind that, as where something passes before a
/// camera at rest. `level`: points of the image before, the finest.
bool denies_rest(const ImageChange& change, const ReferenceLevel& level);

/// What denied rest, against one keyframe: it is denied until most of that looks as it did before,
/// for not every frame of a world in haze shows it.
class RestDenial {
 public:
  /// Whether the change from keyframe `keyframe_id` denies rest, or one before did. `level`: see
  /// denies_rest. `halvings`: those of the change, 1 or 2; each has a denial of its own.
  bool holds(const ImageChange& change, const ReferenceLevel& level, std::uint32_t keyframe_id,
             int halvings);
  /// For a camera that moves.
  void clear() { *this = {}; }

 private:
  std::uint32_t keyframe_id_ = 0;
  std::array<ChosenCells, 2> different_;  ///< By halvings; empty where nothing denies.
};

}  // namespace sovo
