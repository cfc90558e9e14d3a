#pragma once

#include <algorithm>
#include <array>

#include "sovo/geometry/camera_model.h"
#include "sovo/image/image.h"

namespace sovo {

/// How far off the optical axis a ray is: sin^2 of the angle between them, 1 in the farthest corner
/// of an image and beyond it.
class OffAxis {
 public:
  /// `pinhole`: without distortion; its farthest corner counts.
  explicit OffAxis(const CameraModel& pinhole);

  /// Of a ray (x, y, 1).
  double of(double x, double y) const { return std::min(sin2(x * x + y * y) / farthest_, 1.0); }

  /// Of every pixel of a camera; 1 where its distortion cannot be undone.
  ImageF of(const CameraModel& camera) const;

 private:
  static double sin2(double tan2) { return tan2 / (1.0 + tan2); }

  double farthest_;
};

/// The share of its light that a lens lets through off its axis: V(s) = exp(c1 s + c2 s^2 + c3
/// s^3), s as `OffAxis` has it. No term is positive, so that V falls from 1 on the axis.
struct RadialVignette {
  std::array<double, 3> terms{};

  static std::array<double, 3> basis(double s) { return {s, s * s, s * s * s}; }
  double log_at(double s) const { return s * (terms[0] + s * (terms[1] + s * terms[2])); }
  bool any() const { return terms != std::array<double, 3>{}; }
  bool operator==(const RadialVignette&) const = default;
};

/// Images of both cameras freed of a vignette.
class VignetteCorrection {
 public:
  /// `left`, `right`: `OffAxis` of each pixel. Allocates nothing for images of the size of the last
  /// ones.
  void set(const RadialVignette& vignette, const ImageF& left, const ImageF& right);

  const RadialVignette& vignette() const { return vignette_; }
  void apply_left(ImageF* image) const { multiply(left_, image); }
  void apply_right(ImageF* image) const { multiply(right_, image); }

 private:
  static void multiply(const ImageF& gains, ImageF* image);

  RadialVignette vignette_;
  ImageF left_, right_;  ///< 1 / V.
};

}  // namespace sovo
