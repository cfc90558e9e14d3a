#pragma once

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

/// Compares images of half the size, in which what lies a pixel aside looks alike. `rmse`:
/// residuals of what is as expected [grey levels]. Precondition: they are of one size.
ImageChange image_change(const ImagePyramid& before, const ImagePyramid& image, double rmse);

/// Whether what is different may be the world.
bool may_deny_rest(const ImageChange& change);

/// Whether a change says that the camera moves, and only what moves along with it looks the same:
/// much is different, and what stays does not lie behind that, as where something passes before a
/// camera at rest. `level`: points of the image before, the finest.
bool denies_rest(const ImageChange& change, const ReferenceLevel& level);

}  // namespace sovo
