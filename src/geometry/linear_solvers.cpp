#include "sovo/geometry/linear_solvers.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace sovo {

SmallVector solve_small(const SmallMatrix& A, const SmallVector& b) { return A.ldlt().solve(b); }

VecX solve_symmetric(const MatX& A, const VecX& b) { return A.ldlt().solve(b); }

MatX solve_symmetric_columns(const MatX& A, const MatX& B) { return A.ldlt().solve(B); }

SymmetricEigen symmetric_eigen(const MatX& A) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(A);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

}  // namespace sovo
