#include "common/geometry/pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace phantom::geometry {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Vector3d random_vector(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return {normal(random), normal(random), normal(random)};
}

void expect_turns(const Vector3d& from, const Vector3d& to) {
  const Matrix3d R = rotation_between(from, to);
  EXPECT_LT((R * R.transpose() - Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
  EXPECT_LT((R * from.normalized() - to.normalized()).norm(), 1e-9);
  // The least rotation: its angle is that between the two.
  EXPECT_NEAR(R.trace(), 1.0 + 2.0 * from.normalized().dot(to.normalized()), 1e-9);
}

TEST(RotationBetween, IsTheLeastThatTurnsOneIntoTheOther) {
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) expect_turns(random_vector(random), random_vector(random));
}

TEST(RotationBetween, KnowsEqualOppositeAndNearlySuch) {
  std::mt19937 random(8);
  for (int i = 0; i < 100; ++i) {
    const Vector3d a = random_vector(random), aside = random_vector(random);
    expect_turns(a, 3.0 * a);
    expect_turns(a, -2.0 * a);
    for (const double off : {1e-3, 1e-7, 1e-12, 1e-300}) {
      expect_turns(a, a + off * aside);
      expect_turns(a, -a + off * aside);
    }
  }
}

}  // namespace
}  // namespace phantom::geometry
