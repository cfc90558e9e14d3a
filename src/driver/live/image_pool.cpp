#include "sovo/driver/live/image_pool.h"

namespace sovo {

ImagePool::ImagePool(std::size_t count, std::size_t bytes) {
  buffers_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    buffers_.push_back(std::make_shared<std::vector<std::uint8_t>>(bytes));
  }
}

ImagePool::Buffer ImagePool::take() {
  for (std::size_t i = 0; i < buffers_.size(); ++i) {
    // Counting this copy is what makes the last reader's use of the pixels happen before ours.
    Buffer buffer = buffers_[next_];
    next_ = (next_ + 1) % buffers_.size();
    if (buffer.use_count() == 2) return buffer;
  }
  return nullptr;
}

}  // namespace sovo
