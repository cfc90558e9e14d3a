#pragma once

#include <cstdint>
#include <utility>

#include "sovo/image/image.h"

namespace sovo::sim {

/// A square picture of side 1 that continues on its opposite edges, to draw patterns on. Edges of
/// what is drawn are smooth over one texel.
class Canvas {
 public:
  Canvas(int size, float value);
  /// Continues a picture of any content.
  explicit Canvas(ImageF image) : image_(std::move(image)) {}

  /// Rectangle [x0, x1] x [y0, y1].
  void rectangle(double x0, double y0, double x1, double y1, float value, float opacity = 1.0F);

  /// A line that tapers from width `w0` to `w1` while its value goes from `v0` to `v1`.
  struct Stroke {
    double x0, y0, x1, y1;
    double w0, w1;
    float v0, v1;
  };
  void stroke(const Stroke& k);

  /// Ellipse with half axes a and b, turned by `angle` [rad].
  void ellipse(double x, double y, double a, double b, double angle, float value,
               float opacity = 1.0F);

  /// value += amplitude * (noise - 1/2), see `noise`.
  void add_noise(int cells, int octaves, float persistence, float amplitude, std::uint64_t seed);

  int size() const { return image_.width(); }
  ImageF& image() { return image_; }
  const ImageF& image() const { return image_; }

 private:
  void blend(int x, int y, float value, float opacity);

  ImageF image_;
};

}  // namespace sovo::sim
