#include "sovo/vo/likeness.h"

#include <algorithm>
#include <cmath>

namespace sovo {

Likeness likeness(const ImageF& a, const ImageF& b, int x0, int y0, int side) {
  double n = 0.0, sa = 0.0, sb = 0.0, saa = 0.0, sbb = 0.0, sab = 0.0;
  for (int y = y0; y < std::min(y0 + side, a.height()); y += 2) {
    for (int x = x0; x < std::min(x0 + side, a.width()); x += 2) {
      const double va = a.at(x, y);
      const double vb = b.at(x, y);
      n += 1.0;
      sa += va;
      sb += vb;
      saa += va * va;
      sbb += vb * vb;
      sab += va * vb;
    }
  }
  const double var_a = saa / n - sa * sa / (n * n);
  const double var_b = sbb / n - sb * sb / (n * n);
  const double cov = sab / n - sa * sb / (n * n);
  Likeness out;
  if (var_a > 0.0 && var_b > 0.0) out.correlation = cov / std::sqrt(var_a * var_b);
  out.difference = std::sqrt(std::max(0.0, var_a + var_b - 2.0 * cov));
  out.contrast = std::sqrt(std::max({0.0, var_a, var_b}));
  return out;
}

}  // namespace sovo
