#include "common/geometry/symmetric_matrix.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace phantom::geometry {

Vector6 solve_symmetric(const Matrix6& A, const Vector6& b) { return A.ldlt().solve(b); }

Matrix6 inverse_symmetric(const Matrix6& A) { return A.ldlt().solve(Matrix6::Identity()); }

Eigen::Matrix3d inverse_symmetric(const Eigen::Matrix3d& A) {
  return A.ldlt().solve(Eigen::Matrix3d::Identity());
}

Matrix6 square_root(const Matrix6& A) {
  const Eigen::LDLT<Matrix6> parts(A);  // PᵀLDLᵀP
  const Matrix6 lower = parts.matrixL();
  return parts.transpositionsP().transpose() *
         Matrix6(lower * parts.vectorD().cwiseMax(0.0).cwiseSqrt().asDiagonal());
}

double log_determinant(const Matrix6& A) { return Eigen::LDLT<Matrix6>(A).vectorD().array().log().sum(); }

Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& A) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

Vector6 symmetric_eigenvalues(const Matrix6& A) {
  return Eigen::SelfAdjointEigenSolver<Matrix6>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigensystem6 symmetric_eigensystem(const Matrix6& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace phantom::geometry
