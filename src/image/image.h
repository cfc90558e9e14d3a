#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#include "sovo/image/aligned_memory.h"

namespace sovo {

/// What a vector gains by `resize` is not set to zero: an image of a megabyte is written twice
/// otherwise.
template <class T>
struct ImageAllocator : AlignedAllocator<T> {
  ImageAllocator() = default;
  template <class U>
  explicit ImageAllocator(const ImageAllocator<U>& other) : AlignedAllocator<T>(other) {}

  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): the standard's name
    using other = ImageAllocator<U>;
  };
  template <class U>
  void construct(U* p) {
    ::new (static_cast<void*>(p)) U;
  }
  template <class U, class... Args>
  void construct(U* p, Args&&... args) {
    ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
  }
};

/// A single-channel image, rows tightly packed, row-major; `at(x, y)` with x to the right and y
/// down. Values of a float image are grey levels in [0, 255].
template <class T>
class Image {
 public:
  Image() = default;
  /// All zero.
  Image(int width, int height)
      : width_(width),
        height_(height),
        data_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), T{}) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool empty() const { return data_.empty(); }
  std::size_t size() const { return data_.size(); }

  T* data() { return data_.data(); }
  const T* data() const { return data_.data(); }
  T* row(int y) { return data_.data() + static_cast<std::size_t>(y) * width_; }
  const T* row(int y) const { return data_.data() + static_cast<std::size_t>(y) * width_; }
  T& at(int x, int y) { return row(y)[x]; }
  const T& at(int x, int y) const { return row(y)[x]; }

  /// Changes the size; keeps the memory when it is large enough. The content is unspecified.
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    data_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  void fill(const T& value) { data_.assign(data_.size(), value); }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<T, ImageAllocator<T>> data_;
};

using ImageF = Image<float>;
using ImageU8 = Image<std::uint8_t>;

}  // namespace sovo
