#pragma once

#include <memory>
#include <utility>

#include "sovo/image/pyramid.h"

namespace sovo::test {

/// The pyramid of an image, with as many levels as the odometry gives it.
inline ImagePyramidPtr pyramid_of(ImageF image) {
  const int levels = ImagePyramid::num_levels_for(image.width(), image.height());
  return std::make_shared<const ImagePyramid>(std::move(image), levels);
}

}  // namespace sovo::test
