#pragma once

#include "sovo/vo/direct_config.h"
#include "sovo/vo/image_cells.h"
#include "sovo/vo/tracking_reference.h"

namespace sovo {

/// What tracking found of a frame for mapping.
struct CoMovingView : FrameViews {
  ChosenCells cells;  ///< In which things are seen that move along with the camera.
};

/// Cells of an image in which the points of a reference are seen where they were there.
/// `transfer`: of brightness, reference to image.
ChosenCells staying_cells(const CoMovingConfig& config, const ImageCells& cells,
                          const TrackingReference& reference, const ImageF& image,
                          const BrightnessTransfer& transfer);

/// Whether what stays is so much nearer than the rest that it may be the vehicle's own body.
bool stays_nearer(const ImageCells& cells, const TrackingReference& reference,
                  const ChosenCells& staying);

/// Of the `staying` cells those whose points should have moved by the motion of the rest: they move
/// along with the camera. None where they are not nearer than the rest, for then it is the rest
/// that moves, before a world at rest.
ChosenCells co_moving_cells(const CoMovingConfig& config, const ImageCells& cells,
                            const TrackingReference& reference, const SE3& T_current_reference,
                            const ChosenCells& staying);

/// The reference without the points that a motion moves into such cells: behind what is seen there.
TrackingReference without_hidden(const TrackingReference& reference, const ImageCells& cells,
                                 const ChosenCells& chosen, const SE3& T_current_reference);

/// The reference without the points in such cells.
TrackingReference without(const TrackingReference& reference, const ImageCells& cells,
                          const ChosenCells& chosen);

}  // namespace sovo
