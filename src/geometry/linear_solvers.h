#pragma once

#include "sovo/geometry/types.h"

namespace sovo {

// Eigen's decompositions, compiled once: their templates cost the compiler more than the rest of a
// file that uses one.

/// At most 8x8, without allocation.
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;

/// x of A x = b, by a pivoted Cholesky decomposition (LDL^T) of the symmetric A, whose lower
/// triangle is read. A semi-definite A gives a solution in its range; of an indefinite one the
/// caller checks that it is finite.
SmallVector solve_small(const SmallMatrix& A, const SmallVector& b);

/// The same of any size.
VecX solve_symmetric(const MatX& A, const VecX& b);

/// The same for every column of B.
MatX solve_symmetric_columns(const MatX& A, const MatX& B);

/// Eigenvalues, ascending, and orthonormal eigenvectors in columns.
struct SymmetricEigen {
  VecX values;
  MatX vectors;
};

/// Of a symmetric matrix, whose lower triangle is read.
SymmetricEigen symmetric_eigen(const MatX& A);

}  // namespace sovo
