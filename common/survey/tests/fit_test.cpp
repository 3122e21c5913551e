#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <random>

#include "common/survey/survey.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

HeadErrors no_errors() {
  HeadErrors errors;
  errors.range_m = errors.pan_rad = errors.tilt_rad = errors.targeting_m = 0.0;
  return errors;
}

/// A part measured without errors, registered with the instrument's.
struct Exact {
  geometry::Pose X_WO;
  Measurement measurement;
  NodeMap map;
};
Exact exact(const PartModel& part, const geometry::Pose& X_WO) {
  const RangeHead head = test_head();
  std::mt19937_64 random(1);
  const auto faces = visible_faces(part, X_WO, head.X_WH.translation_m);
  Exact e{X_WO,
          *register_nodes(head, {}, *simulate_targetings(part, X_WO, faces, head, no_errors(), random)),
          {}};
  for (const MeasuredNode& node : e.measurement.nodes) {
    std::uint32_t nearest = 0;
    for (std::uint32_t i = 0; i < part.nodes_O_m.size(); ++i) {
      if ((X_WO * part.nodes_O_m[i] - node.p_W_m).norm() <
          (X_WO * part.nodes_O_m[nearest] - node.p_W_m).norm())
        nearest = i;
    }
    e.map.push_back(nearest);
  }
  return e;
}

double apart(const geometry::Pose& a, const geometry::Pose& b) {
  return (a.rotation - b.rotation).norm() + (a.translation_m - b.translation_m).norm();
}

TEST(Fit, WithoutErrorsTheFourStepsAndTheRefinementGiveThePoseItself) {
  std::mt19937_64 random(3);
  for (const PartModel& part : shipped_library()) {
    for (int i = 0; i < 10; ++i) {
      const Exact e = exact(part, random_pose(random));
      if (e.measurement.nodes.size() < 3) continue;  // the vice from behind
      for (const MeasuredFace& face : e.measurement.faces) {
        if (face.nodes.size() < 3) continue;
        const auto X = fit_four_steps(part, e.measurement, face, e.map,
                                      largest_triangle(corners_of(e.measurement, face)),
                                      best_anchor(e.measurement, face));
        EXPECT_LT(apart(X, e.X_WO), 1e-6) << part.name;
      }
      geometry::Pose start = e.X_WO;  // 20° and 5 cm off
      start.rotation =
          geometry::rotation_about(Eigen::Vector3d(1, 2, -1).normalized(), 0.35) * start.rotation;
      start.translation_m += Eigen::Vector3d(0.03, -0.04, 0.01);
      const auto fit = refine(part, e.measurement, e.map, start);
      ASSERT_TRUE(fit) << fit.status().message();
      EXPECT_LT(apart(fit->X_WO, e.X_WO), 1e-6) << part.name;
      EXPECT_LT(fit->chi2, 1e-6);
    }
  }
}

TEST(Fit, TheDisplacementsJacobianIsThatOfFiniteDifferences) {
  const Exact e = exact(part_named("wedge"), {});
  PoseFit fit = *refine(part_named("wedge"), e.measurement, e.map, e.X_WO);
  const Eigen::Vector3d p(0.3, -0.2, 0.1);
  const auto J = displacement_jacobian(fit, p);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const auto moved = [&](double by) -> Eigen::Vector3d {
      if (i >= 3) return p + by * Eigen::Vector3d::Unit(i - 3);
      return fit.centre_W_m + geometry::rotation_about(Eigen::Vector3d::Unit(i), by) * (p - fit.centre_W_m);
    };
    EXPECT_LT((J.col(i) - (moved(kStep) - moved(-kStep)) / (2 * kStep)).norm(), 1e-9);
  }
}

// The covariance against a literal one: how the fitted pose answers to each node's coordinates, by
// differences.
TEST(Fit, TheCovarianceIsThatOfThePropagatedNodesByFiniteDifferences) {
  std::mt19937_64 random(9);
  for (const char* name : {"v_groove_block", "bar", "wedge"}) {
    const PartModel& part = part_named(name);
    const Exact e = exact(part, random_pose(random));
    const PoseFit fit = *refine(part, e.measurement, e.map, e.X_WO);
    Eigen::Matrix<double, 6, 6> literal = Eigen::Matrix<double, 6, 6>::Zero();
    constexpr double kStep = 1e-5;
    for (std::size_t node = 0; node < e.measurement.nodes.size(); ++node) {
      Eigen::Matrix<double, 6, 3> by_node;
      for (int axis = 0; axis < 3; ++axis) {
        Measurement more = e.measurement, less = e.measurement;
        more.nodes[node].p_W_m[axis] += kStep;
        less.nodes[node].p_W_m[axis] -= kStep;
        const geometry::Pose a = refine(part, less, e.map, e.X_WO)->X_WO,
                             b = refine(part, more, e.map, e.X_WO)->X_WO;
        const Eigen::AngleAxisd turn(Eigen::Matrix3d(b.rotation * a.rotation.transpose()));
        const Eigen::Vector3d centre_O = fit.X_WO.inverse() * fit.centre_W_m;
        by_node.col(axis) << turn.angle() * turn.axis(), b * centre_O - a * centre_O;
      }
      by_node /= 2 * kStep;
      literal += by_node * e.measurement.nodes[node].covariance_m2 * by_node.transpose();
    }
    EXPECT_LT((literal - fit.covariance).norm(), 1e-3 * fit.covariance.norm()) << name;
  }
}

// Tries workspace_survey: nodes that do not determine the pose
TEST(Fit, ThreeNodesInLineAreRefused) {
  const PartModel& part = part_named("brick");
  Exact e = exact(part, {});
  NodeMap two(e.map.size(), kNotMapped);
  two[0] = e.map[0];
  two[1] = e.map[1];
  EXPECT_THAT(refine(part, e.measurement, two, {}).status().message(),
              testing::HasSubstr("2 nodes do not determine a pose"));
  PartModel line = part;
  for (std::size_t i = 0; i < line.nodes_O_m.size(); ++i)
    line.nodes_O_m[i] = Eigen::Vector3d(0.1 * static_cast<double>(i), 0, 0);
  EXPECT_THAT(refine(line, e.measurement, e.map, {}).status().message(), testing::HasSubstr("one line"));
}

TEST(Fit, GuardVoxelsCoverTheDisplacement) {
  EXPECT_EQ(guard_voxels(0.0, 0.01), 0);
  EXPECT_EQ(guard_voxels(0.0001, 0.01), 1);
  EXPECT_EQ(guard_voxels(0.01, 0.01), 1);
  EXPECT_EQ(guard_voxels(0.0101, 0.01), 2);
  EXPECT_EQ(guard_voxels(0.0101, 0.005), 3);
}

// The centre of the farthest voxel into which a point moves, tried for points all over a voxel.
TEST(Fit, GuardVoxelsReachTheCentresOfFlatVoxelsIntoWhichADisplacementCarries) {
  const auto sized = [](double x_m, double y_m, double z_m) {
    return workspace::VoxelSize(Eigen::Vector3d(x_m, y_m, z_m));
  };
  EXPECT_EQ(guard_voxels(0.0, sized(0.005, 0.005, 0.01)), 0);
  EXPECT_EQ(guard_voxels(0.003, sized(0.005, 0.005, 0.01)), 2) << "the next voxel along z is 10 mm away";
  EXPECT_EQ(guard_voxels(0.010, sized(0.005, 0.005, 0.01)), 2);
  EXPECT_EQ(guard_voxels(0.011, sized(0.005, 0.005, 0.01)), 4);
  EXPECT_EQ(guard_voxels(0.004, sized(0.005, 0.0125, 0.005)), 3) << "12.5 mm in lengths of 5 mm";
  std::mt19937_64 random(14);
  std::uniform_real_distribution<double> side(0.001, 0.008), moved(1e-4, 0.03);
  for (int trial = 0; trial < 300; ++trial) {
    const std::array<double, 3> sides_m{side(random), side(random), side(random)};
    const double least_m = *std::min_element(sides_m.begin(), sides_m.end()), d_m = moved(random);
    double farthest_m = 0.0;
    for (const double s : sides_m)
      for (int point = 0; point < 1000; ++point)
        farthest_m = std::max(farthest_m, s * std::floor((point + 0.5) / 1000.0 + d_m / s));
    const int guard = guard_voxels(d_m, sized(sides_m[0], sides_m[1], sides_m[2]));
    ASSERT_GE(guard * least_m, farthest_m - 1e-12) << d_m;
    ASSERT_LT((guard - 1) * least_m, *std::max_element(sides_m.begin(), sides_m.end()) + d_m) << d_m;
  }
}

// A.5.1: the larger triangle gives the better orientation, the refinement over all nodes a better one than
// both.
TEST(Fit, TheLargerTriangleIsBetterAndTheRefinementBetterStill) {
  const PartModel& part = part_named("v_groove_block");
  const RangeHead head = test_head();
  geometry::Pose X_WO;
  X_WO.rotation = geometry::rotation_between(Eigen::Vector3d::UnitZ(), head.X_WH.translation_m.normalized());
  VisibleOptions one;
  one.most_faces = 1;
  const Exact truth = exact(part, X_WO);
  std::mt19937_64 random(21);
  double small_m = 0.0, large_m = 0.0, refined_m = 0.0;
  for (int run = 0; run < 500; ++run) {
    const Measurement m = measure(part, X_WO, head, {}, random, one);
    const MeasuredFace& face = m.faces[0];
    NodeMap map;
    for (const MeasuredNode& node : m.nodes) {
      std::uint32_t nearest = 0;
      for (std::uint32_t i = 0; i < part.nodes_O_m.size(); ++i) {
        if ((X_WO * part.nodes_O_m[i] - node.p_W_m).norm() <
            (X_WO * part.nodes_O_m[nearest] - node.p_W_m).norm())
          nearest = i;
      }
      map.push_back(nearest);
    }
    const std::size_t anchor = best_anchor(m, face);
    const auto error_m = [&](const geometry::Pose& X) { return displacement_between_m(part, X, X_WO); };
    small_m += error_m(fit_four_steps(part, m, face, map, {3, 4, 5}, anchor));  // about the groove
    large_m += error_m(fit_four_steps(part, m, face, map, largest_triangle(corners_of(m, face)), anchor));
    refined_m += error_m(refine(part, m, map, X_WO)->X_WO);
  }
  EXPECT_LT(large_m, 0.8 * small_m);
  EXPECT_LT(refined_m, 0.8 * large_m);
}

}  // namespace
}  // namespace phantom::survey
