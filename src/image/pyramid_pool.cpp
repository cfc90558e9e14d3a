#include "sovo/image/pyramid_pool.h"

namespace sovo {

std::shared_ptr<ImagePyramid> PyramidPool::take() {
  for (std::size_t i = 0; i < pyramids_.size(); ++i) {
    // Counting this copy is what makes the last reader's use of the pixels happen before ours.
    std::shared_ptr<ImagePyramid> pyramid = pyramids_[next_];
    next_ = (next_ + 1) % pyramids_.size();
    if (pyramid.use_count() == 2) return pyramid;
  }
  pyramids_.push_back(std::make_shared<ImagePyramid>());
  return pyramids_.back();
}

void PyramidPool::reserve(std::size_t count, int width, int height, int max_levels) {
  while (pyramids_.size() < count) {
    pyramids_.push_back(std::make_shared<ImagePyramid>());
    pyramids_.back()->rebuild(max_levels, [&](ImageF* image) { *image = ImageF(width, height); });
  }
}

}  // namespace sovo
