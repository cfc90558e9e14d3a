#pragma once

#include <cstddef>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/types.h"
#include "sovo/image/image.h"

namespace sovo {

/// Undoes what turning does to the images of a rolling shutter, whose rows are exposed one after
/// the other. Each pixel of the result shows what the raw image has on its ray, as that ray lies in
/// the camera when the row was exposed where it shows. What moving straight on does depends on
/// depths, and stays (ViewShift).
class Unroller {
 public:
  /// From images of `raw` to those of `result`, a camera with the same axes, maybe the same one.
  Unroller(const CameraModel& raw, const CameraModel& result);

  /// Places of a lattice over the result in the raw image, less where they are without turning.
  struct Lattice {
    std::vector<float> x, y;  ///< [px]
  };

  /// `turn`: log of the rotation that maps the camera at the first row into that at the last one
  /// [rad], in its own axes. The image's instant is that of its middle row. What comes from beside
  /// the raw image repeats its edge. `lattice` keeps memory for the next call.
  void apply(const ImageF& raw, const Vec3& turn, Lattice* lattice, ImageF* out) const;

  /// Which row of the result comes from the middle of the raw image, and how many rows of that one
  /// of the result takes, both as the best line has them.
  double middle_row() const { return middle_row_; }
  double raw_rows() const { return raw_rows_; }

  /// Greatest displacement of a pixel by a turn [px].
  double reach(const Vec3& turn) const;

 private:
  static constexpr int kStep = 16;  ///< Of the lattice [px].

  /// Of a row of `x_`: whole steps of the lattice.
  std::size_t stride() const { return (nodes_x_ - 1) * kStep; }
  void fit_rows();
  void place_lattice(const Vec3& turn, Lattice* lattice) const;

  CameraModel raw_, result_;
  std::size_t nodes_x_, nodes_y_;
  AlignedVector<float> x_, y_;  ///< Where each pixel of the result comes from without turning.
  double middle_row_ = 0.0;
  double raw_rows_ = 1.0;
};

}  // namespace sovo
