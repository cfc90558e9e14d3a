#pragma once

#include <algorithm>
#include <array>
#include <utility>

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

/// Frees images of a camera of a vignette.
class VignetteCorrection {
 public:
  /// `off_axis`: `OffAxis` of each pixel.
  explicit VignetteCorrection(ImageF off_axis) : off_axis_(std::move(off_axis)) {}

  /// Divides every pixel by V. Nothing of it is kept from image to image, so that V may change at
  /// any time. Precondition: `image` has the size of `off_axis`, log V is -2 at least.
  void apply(const RadialVignette& vignette, ImageF* image) const;

 private:
  ImageF off_axis_;
};

}  // namespace sovo
