#pragma once
// Decompositions of small symmetric matrices (covariance, information), compiled once: Eigen's templates for
// them take seconds in each source that names them.

#include <Eigen/Core>

namespace phantom::geometry {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Returns x of A·x = b by LDLᵀ with pivots. A: symmetric, positive or negative semi-definite; x is not
/// finite where A is singular and b is not in its range. Real-time safe.
Vector6 solve_symmetric(const Matrix6& A, const Vector6& b);
/// Returns A⁻¹ by the same.
Matrix6 inverse_symmetric(const Matrix6& A);
Eigen::Matrix3d inverse_symmetric(const Eigen::Matrix3d& A);
/// Returns R with R·Rᵀ = A, for a semi-definite A, too. Real-time safe.
Matrix6 square_root(const Matrix6& A);
/// Returns ln det A of a positive definite A; not finite for others. Real-time safe.
double log_determinant(const Matrix6& A);

/// Returns the eigenvalues of a symmetric matrix, the least first. Real-time safe.
Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& A);
Vector6 symmetric_eigenvalues(const Matrix6& A);

/// Eigenvalues, the least first, with the eigenvectors of length 1 in columns.
struct Eigensystem6 {
  Vector6 values;
  Matrix6 vectors;
};
/// Real-time safe.
Eigensystem6 symmetric_eigensystem(const Matrix6& A);

}  // namespace phantom::geometry
