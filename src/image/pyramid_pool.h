#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "sovo/image/pyramid.h"

namespace sovo {

/// Pyramids that are used again and again, so that no frame allocates memory. One is free when
/// nobody but the pool holds it; while none is, the pool grows.
class PyramidPool {
 public:
  /// A free pyramid, with what was in it before. Call from one thread; pyramids may be given up on
  /// any.
  std::shared_ptr<ImagePyramid> take();

  /// Makes `count` pyramids beforehand, their memory written once: the first frames would else wait
  /// until the kernel has found and cleared pages for them.
  void reserve(std::size_t count, int width, int height, int max_levels);

 private:
  std::vector<std::shared_ptr<ImagePyramid>> pyramids_;
  std::size_t next_ = 0;
};

}  // namespace sovo
