#pragma once

#include <cstddef>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// A measured motion between two poses of a graph.
struct GraphEdge {
  std::size_t i = 0, j = 0;
  SE3 T_i_j;
  /// Inverse covariance of (translation, rotation): the true motion is exp(e) T_i_j.
  Mat6 information = Mat6::Identity();
  /// Whether it may be wrong altogether: its error then counts as Cauchy's does.
  bool may_be_wrong = false;
};

/// e of an edge: the motion between the poses is exp(e) T_i_j.
Vec6 edge_error(const GraphEdge& edge, const SE3& T_w_i, const SE3& T_w_j);

/// Its derivatives by x in exp(x) T_w_i (that by exp(x) T_w_j is their negative).
Mat6 edge_jacobian(const GraphEdge& edge, const SE3& T_w_i, const SE3& T_w_j);

struct GraphResult {
  int iterations = 0;
  double energy = 0.0;  ///< Sum of robust squared errors, in their standard deviations.
};

/// Moves the poses so that the edges' squared errors become least, by Levenberg-Marquardt with a
/// sparse Cholesky decomposition. The first pose stays; every pose must hang on it by edges.
GraphResult optimize_graph(const std::vector<GraphEdge>& edges, std::vector<SE3>* T_w);

}  // namespace sovo
