#include "sovo/image/pyramid.h"

#include <utility>

#include "sovo/image/halving.h"

namespace sovo {

int ImagePyramid::num_levels_for(int width, int height, int max_levels, int min_side) {
  int levels = 1;
  while (levels < max_levels && width / 2 >= min_side && height / 2 >= min_side) {
    width /= 2;
    height /= 2;
    ++levels;
  }
  return levels;
}

ImagePyramid::ImagePyramid(ImageF level0, int levels) {
  levels_.push_back(std::move(level0));
  halve_to(levels);
}

void ImagePyramid::halve_to(int levels) {
  levels_.resize(static_cast<std::size_t>(levels));
  for (int l = 1; l < levels; ++l) {
    halve(levels_[static_cast<std::size_t>(l - 1)], &levels_[static_cast<std::size_t>(l)]);
  }
}

}  // namespace sovo
