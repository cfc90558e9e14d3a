#pragma once

#include <memory>
#include <vector>

#include "sovo/image/image.h"

namespace sovo {

/// An image at halved resolutions; level 0 is the full image. Level l pixel p covers level l-1
/// pixels 2p and 2p+1 (2x2 mean), so positions map as x_l = (x_0 + 1/2) / 2^l - 1/2.
class ImagePyramid {
 public:
  /// How many levels an image of this size gets: halved while both sides stay at least
  /// `min_side` pixels, at most `max_levels`. An odd last row or column is cut.
  static int num_levels_for(int width, int height, int max_levels = 6, int min_side = 24);

  ImagePyramid() = default;

  /// Builds `levels` levels from level 0, whose pixels are taken over.
  ImagePyramid(ImageF level0, int levels);

  /// Lets `fill` (ImageF*) write level 0 and builds as many levels as its size has, at most
  /// `max_levels`, in the memory that they had.
  template <class Fill>
  void rebuild(int max_levels, const Fill& fill) {
    if (levels_.empty()) levels_.resize(1);
    fill(&levels_[0]);
    halve_to(num_levels_for(levels_[0].width(), levels_[0].height(), max_levels));
  }

  int num_levels() const { return static_cast<int>(levels_.size()); }
  const ImageF& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }
  const ImageF& operator[](int l) const { return level(l); }

 private:
  void halve_to(int levels);

  std::vector<ImageF> levels_;
};

using ImagePyramidPtr = std::shared_ptr<const ImagePyramid>;

}  // namespace sovo
