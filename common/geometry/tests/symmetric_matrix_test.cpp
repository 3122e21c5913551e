// Random symmetric matrices: each decomposition gives the matrix back.
#include "common/geometry/symmetric_matrix.hpp"

#include <gtest/gtest.h>

#include <random>

namespace phantom::geometry {
namespace {

constexpr int kMatrices = 200;

/// A positive semi-definite matrix of rank `rank`, with entries of about `scale`.
Matrix6 random_matrix(std::mt19937& random, int rank, double scale) {
  std::normal_distribution<double> normal;
  Matrix6 A = Matrix6::Zero();
  for (int k = 0; k < rank; ++k) {
    Vector6 v;
    for (int i = 0; i < 6; ++i) v[i] = normal(random);
    A += scale * v * v.transpose();
  }
  return A;
}

TEST(SymmetricMatrix, SolvesAndInverts) {
  std::mt19937 random(1);
  for (int k = 0; k < kMatrices; ++k) {
    const Matrix6 A = random_matrix(random, 9, std::pow(10.0, k % 13 - 6));
    const Vector6 x = Vector6::Random();
    const double tolerance = 1e-12 * A.norm() * inverse_symmetric(A).norm();
    EXPECT_LT((solve_symmetric(A, A * x) - x).norm(), tolerance * x.norm());
    EXPECT_LT((inverse_symmetric(A) * A - Matrix6::Identity()).norm(), tolerance);
    const Eigen::Matrix3d corner = A.topLeftCorner<3, 3>();
    EXPECT_LT((inverse_symmetric(corner) * corner - Eigen::Matrix3d::Identity()).norm(), tolerance);
  }
}

TEST(SymmetricMatrix, TheSquareRootOfASemiDefiniteMatrixGivesItBack) {
  std::mt19937 random(2);
  for (int k = 0; k < kMatrices; ++k) {
    const Matrix6 A = random_matrix(random, 1 + k % 6, 1.0);
    const Matrix6 R = square_root(A);
    EXPECT_LT((R * R.transpose() - A).norm(), 1e-7 * A.norm()) << "rank " << 1 + k % 6;
  }
}

TEST(SymmetricMatrix, EigenvaluesRiseAndGiveTraceDeterminantAndMatrix) {
  std::mt19937 random(3);
  for (int k = 0; k < kMatrices; ++k) {
    const Matrix6 A = random_matrix(random, 9, 1.0);
    const Vector6 values = symmetric_eigenvalues(A);
    for (int i = 1; i < 6; ++i) EXPECT_LE(values[i - 1], values[i]);
    EXPECT_NEAR(values.sum(), A.trace(), 1e-12 * A.trace());
    EXPECT_NEAR(log_determinant(A), values.array().log().sum(), 1e-9);
    const Eigensystem6 whole = symmetric_eigensystem(A);
    EXPECT_LT((whole.vectors * whole.values.asDiagonal() * whole.vectors.transpose() - A).norm(),
              1e-12 * A.norm());
    const Eigen::Matrix3d corner = A.topLeftCorner<3, 3>();
    EXPECT_NEAR(symmetric_eigenvalues(corner).sum(), corner.trace(), 1e-12 * A.trace());
  }
}

}  // namespace
}  // namespace phantom::geometry
