#pragma once

#include <cmath>

namespace sovo {

/// Sums of pairs of values.
struct Moments {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  double squared_gradient = 0.0;  ///< Of y.

  /// Pairs that are left out are zero in all four.
  void add(float one, float a, float b, float squared) {
    const double da = a;
    const double db = b;
    n += one;
    x += da;
    y += db;
    xx += da * da;
    yy += db * db;
    xy += da * db;
    squared_gradient += squared;
  }

  void add_weighted(double weight, double a, double b) {
    n += weight;
    x += weight * a;
    y += weight * b;
    xx += weight * a * a;
    yy += weight * b * b;
    xy += weight * a * b;
  }

  /// Pearson's; 0 where either does not vary.
  double correlation() const {
    const double var_x = n * xx - x * x;
    const double var_y = n * yy - y * y;
    return var_x > 0.0 && var_y > 0.0 ? (n * xy - x * y) / std::sqrt(var_x * var_y) : 0.0;
  }

  double sharpness() const {
    const double var_y = n * yy - y * y;
    return var_y > 0.0 ? n * squared_gradient / var_y : 0.0;
  }
};

}  // namespace sovo
