#pragma once

#include "sovo/image/image.h"

namespace sovo {

struct LocalContrastConfig {
  double radius = 0.03;  ///< Of the mean around a pixel, share of the image's width.
  double floor = 8.0;  ///< Added to the mean, so that noise in the dark stays small [grey levels].

  template <class Visitor>
  void visit(Visitor& v) {
    v("radius", radius, "of the mean around a pixel, share of the image's width");
    v("floor", floor, "added to the mean, so that noise in the dark stays small [grey levels]");
  }
};

/// Takes the light out of images whose lamps move with the cameras, so that a thing looks alike
/// wherever the beam is: I <- 100 I / (mean + floor), with the mean around each pixel (a triangular
/// weight of the given radius), at most 255.
class LocalContrast {
 public:
  explicit LocalContrast(const LocalContrastConfig& config) : config_(config) {}

  /// Changes every pixel of `image`. Precondition: radius and floor are positive. Allocates nothing
  /// for images of the size of the last one.
  void apply(ImageF* image);

 private:
  /// Means of blocks of pixels, and what they are multiplied with.
  void average_blocks(const ImageF& image);
  void smooth(int radius);
  void multiply(ImageF* image);

  LocalContrastConfig config_;
  ImageF blocks_;
  ImageF scratch_;
  AlignedVector<float> sums_;
  AlignedVector<float> row_;
  AlignedVector<float> columns_;
};

}  // namespace sovo
