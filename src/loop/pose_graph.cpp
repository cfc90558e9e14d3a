#include "sovo/loop/pose_graph.h"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace sovo {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// Squared error of 6 numbers that 95 % of right edges stay below.
constexpr double kCauchySquared = 12.6;

/// Cauchy's loss of a squared error, and its derivative, the weight.
struct Loss {
  double value = 0.0, weight = 1.0;
};

Loss loss_of(const GraphEdge& edge, double squared) {
  if (!edge.may_be_wrong) return {squared, 1.0};
  const double relative = 1.0 + squared / kCauchySquared;
  return {kCauchySquared * std::log(relative), 1.0 / relative};
}

double energy_of(const std::vector<GraphEdge>& edges, const std::vector<SE3>& T_w) {
  double energy = 0.0;
  for (const GraphEdge& edge : edges) {
    const Vec6 e = edge_error(edge, T_w[edge.i], T_w[edge.j]);
    energy += loss_of(edge, e.dot(edge.information * e)).value;
  }
  return energy;
}

/// H x = -b of all poses but the first; of H the lower triangle.
struct GraphEquations {
  SparseMatrix H;
  VecX b;
};

GraphEquations equations_of(const std::vector<GraphEdge>& edges, const std::vector<SE3>& T_w) {
  const auto n = static_cast<Eigen::Index>(6 * (T_w.size() - 1));
  GraphEquations out;
  out.b = VecX::Zero(n);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(edges.size() * 108);
  const auto add = [&entries](std::size_t row, std::size_t column, const Mat6& block) {
    if (row == 0 || column == 0 || row < column) return;
    for (int r = 0; r < 6; ++r) {
      for (int c = 0; c < 6; ++c) {
        entries.emplace_back(static_cast<int>(6 * (row - 1)) + r,
                             static_cast<int>(6 * (column - 1)) + c, block(r, c));
      }
    }
  };
  for (const GraphEdge& edge : edges) {
    const Vec6 e = edge_error(edge, T_w[edge.i], T_w[edge.j]);
    const Mat6 J = edge_jacobian(edge, T_w[edge.i], T_w[edge.j]);
    const double weight = loss_of(edge, e.dot(edge.information * e)).weight;
    const Mat6 WJ = weight * edge.information * J;
    const Mat6 JWJ = J.transpose() * WJ;
    const Vec6 JWe = WJ.transpose() * e;
    add(edge.i, edge.i, JWJ);
    add(edge.j, edge.j, JWJ);
    add(edge.i, edge.j, -JWJ);
    add(edge.j, edge.i, -JWJ.transpose());
    if (edge.i > 0) out.b.segment<6>(static_cast<Eigen::Index>(6 * (edge.i - 1))) += JWe;
    if (edge.j > 0) out.b.segment<6>(static_cast<Eigen::Index>(6 * (edge.j - 1))) -= JWe;
  }
  out.H.resize(n, n);
  out.H.setFromTriplets(entries.begin(), entries.end());
  return out;
}

std::vector<SE3> moved(const std::vector<SE3>& T_w, const VecX& x) {
  std::vector<SE3> out = T_w;
  for (std::size_t k = 1; k < T_w.size(); ++k) {
    const Vec6 step = x.segment<6>(static_cast<Eigen::Index>(6 * (k - 1)));
    out[k] = SE3::exp(step) * T_w[k];
  }
  return out;
}

}  // namespace

Vec6 edge_error(const GraphEdge& edge, const SE3& T_w_i, const SE3& T_w_j) {
  return (T_w_i.inverse() * T_w_j * edge.T_i_j.inverse()).log();
}

/// T_i_w exp(-x) T_w_j Z^-1 = exp(-Ad(T_i_w) x) exp(e) = exp(e - J(e)^-1 Ad(T_i_w) x).
Mat6 edge_jacobian(const GraphEdge& edge, const SE3& T_w_i, const SE3& T_w_j) {
  const Vec6 e = edge_error(edge, T_w_i, T_w_j);
  return -SE3::left_jacobian(e).inverse() * T_w_i.inverse().adjoint();
}

GraphResult optimize_graph(const std::vector<GraphEdge>& edges, std::vector<SE3>* T_w) {
  constexpr int kMostIterations = 50;
  constexpr double kConverged = 1e-6;  // relative change of the energy
  GraphResult result;
  result.energy = energy_of(edges, *T_w);
  if (T_w->size() < 2) return result;
  double damping = 1e-6;
  GraphEquations equations = equations_of(edges, *T_w);
  Eigen::SimplicialLDLT<SparseMatrix> solver;
  solver.analyzePattern(equations.H);
  while (result.iterations < kMostIterations && damping < 1e6) {
    ++result.iterations;
    SparseMatrix damped = equations.H;
    damped.diagonal() *= 1.0 + damping;
    solver.factorize(damped);
    const VecX x = solver.info() == Eigen::Success ? VecX(solver.solve(-equations.b)) : VecX();
    const std::vector<SE3> tried = x.size() > 0 && x.allFinite() ? moved(*T_w, x) : *T_w;
    const double energy = energy_of(edges, tried);
    if (!(energy < result.energy)) {
      damping *= 10.0;
      continue;
    }
    const bool converged = result.energy - energy <= kConverged * result.energy;
    *T_w = tried;
    result.energy = energy;
    if (converged) break;
    damping = std::max(1e-9, 0.1 * damping);
    equations = equations_of(edges, *T_w);
  }
  return result;
}

}  // namespace sovo
