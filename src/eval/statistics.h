#pragma once

#include <span>
#include <vector>

namespace sovo {

/// The usual numbers about a set of errors; all zero for an empty set.
struct Statistics {
  int count = 0;
  double mean = 0.0;
  double rmse = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};

Statistics statistics_of(std::span<const double> errors);

/// The value below which the fraction `q` in [0, 1] of the values lies, linear between them.
/// 0 for an empty set.
double quantile(std::vector<double> values, double q);

}  // namespace sovo
