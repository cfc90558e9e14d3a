#include "sovo/eval/nees.h"

#include <cmath>

namespace sovo {
namespace {

/// chi-square quantile / dof at the normal quantile z (Wilson and Hilferty 1931).
double chi_square_per_dof(double dof, double z) {
  const double variance = 2.0 / (9.0 * dof);
  const double root = 1.0 - variance + z * std::sqrt(variance);
  return root > 0.0 ? root * root * root : 0.0;
}

}  // namespace

NeesSummary nees_summary(std::span<const double> errors, std::span<const double> sigmas) {
  NeesSummary out;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!(sigmas[i] > 0.0) || !std::isfinite(sigmas[i]) || !std::isfinite(errors[i])) continue;
    const double normalized = errors[i] / sigmas[i];
    out.mean += normalized * normalized;
    ++out.count;
  }
  if (out.count == 0) return out;
  out.mean /= out.count;
  out.lower95 = chi_square_per_dof(out.count, -1.959964);
  out.upper95 = chi_square_per_dof(out.count, 1.959964);
  return out;
}

}  // namespace sovo
