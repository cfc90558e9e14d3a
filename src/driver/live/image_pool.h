#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace sovo {

/// Image buffers that are made once and used again and again, so that no frame allocates memory. A
/// buffer is free when nobody but the pool holds it.
class ImagePool {
 public:
  using Buffer = std::shared_ptr<std::vector<std::uint8_t>>;

  ImagePool(std::size_t count, std::size_t bytes);

  /// A free buffer of the pool's size, with what was in it before; null when all are in use. Call
  /// from one thread; buffers may be given up on any.
  Buffer take();

 private:
  std::vector<Buffer> buffers_;
  std::size_t next_ = 0;
};

}  // namespace sovo
