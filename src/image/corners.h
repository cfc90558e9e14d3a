#pragma once

#include <vector>

#include "sovo/image/image.h"

namespace sovo {

/// A pixel whose surroundings differ from those of its neighbours in every direction.
struct Corner {
  float response = 0.0F;  ///< Mean squared gradient in the direction of the least [(grey/px)^2].
  int x = 0, y = 0;
};

/// Response of every pixel: the lesser eigenvalue of the second moments of the gradients around it
/// (Shi, Tomasi, "Good Features to Track", 1994), their mean over a square of 5x5 pixels; 0 at the
/// edge.
ImageF corner_response(const ImageF& image);

struct CornerRequest {
  const ImageU8& mask;  ///< 0 where nothing is looked for, at level 0; may be empty.
  int level = 0;        ///< Of the pyramid that the response is of.
  int border = 3;       ///< Least distance to the edge [px].
  int wanted = 500;     ///< Corners at most.
  float least = 10.0F;  ///< Response of a corner.
};

/// Local maxima of the response, the best ones of each cell of a grid that has room for `wanted`;
/// the strongest first.
std::vector<Corner> spread_corners(const ImageF& response, const CornerRequest& request);

}  // namespace sovo
