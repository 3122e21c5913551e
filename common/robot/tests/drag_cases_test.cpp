// The cases of the thesis's appendix C, each with its own shortcut, against the one formula that is built;
// what drag does to energy; and what directional drag does on a way to an object and back.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "common/robot/drag/drag.hpp"
#include "common/robot/sensing/skin_sensing.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/robot/tests/test_worlds.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;

const workspace::Workspace& ball_world() {
  static const workspace::Workspace workspace = test_worlds::balls();
  return workspace;
}

/// An arm with a skin in the world; coefficients of a pose.
struct CaseRig {
  CaseRig(SerialArm arm_in, const std::vector<LinkSkin>& skin,
          Normalisation normalisation = Normalisation::kNone)
      : arm(std::move(arm_in)),
        layout(*lay_out_skin(arm, skin, {.voxel_size_m = 0.01, .normalisation = normalisation})),
        sensing(layout, {.gradient = true}) {}

  const DragCoefficients& at(const JointArray& q, const DirectionalLaw& law = {}, const JointArray& v = {}) {
    arm.link_poses(q, X_WL);
    sensing.sense(X_WL, arm.joint_count(), ball_world());
    drag_coefficients(arm, X_WL, sensing.sums(), law, v, drag);
    return drag;
  }
  /// Calls visit(sensor, place in W, w·μ_e) for the sensors of a link: Ω of eq. c.8.
  template <class Visit>
  void for_link(std::size_t link, Visit&& visit) const {
    for (std::size_t s = layout.first[link]; s < layout.first[link + 1]; ++s) {
      const Eigen::Vector3d p = X_WL[link] * layout.position(s);
      visit(s, p, layout.weight[s] * static_cast<double>(ball_world().mu(ball_world().grid().index_of(p))));
    }
  }

  SerialArm arm;
  SkinLayout layout;
  SkinSensing sensing;
  LinkPoses X_WL;
  DragCoefficients drag;
};

/// A vertical base joint, then a link along its own joint's axis (spin), then two links across theirs.
SerialArm case_arm() {
  std::vector<DhRow> rows(4);
  const double quarter = std::numbers::pi / 2;
  for (std::size_t i = 0; i < 4; ++i) {
    rows[i].link = "link_" + std::to_string(i + 1);
    rows[i].lower = -3.0, rows[i].upper = 3.0, rows[i].max_speed = rows[i].max_effort = 1.0;
  }
  rows[0].d_m = 0.5, rows[0].alpha_rad = quarter;   // vertical axis; the next one lies
  rows[1].d_m = 0.45, rows[1].alpha_rad = quarter;  // along its own axis
  rows[2].a_m = 0.35, rows[3].a_m = 0.3;            // across their axes
  return *SerialArm::from_dh(rows, DhConvention::kClassic, test_arms::at(-0.25, -0.05, 0.3));
}

std::vector<LinkSkin> case_skin(const SerialArm& arm) {
  std::vector<LinkSkin> skin;
  for (std::size_t i = 2; i <= 4; ++i) {
    SkinSegment segment;
    const std::string link = "link_" + std::to_string(i);
    EXPECT_TRUE(place_along_link_axis(arm, link, 0.02, 0.25, segment));
    segment.from_radius_m = 0.05, segment.to_radius_m = 0.03;
    skin.push_back({link, {segment}, {}, {}});
  }
  return skin;
}

/// Case i, spin (5.29–5.33): a sensor's distance from the link's own axis is its ring's radius.
TEST(AppendixC, SpinAboutTheLinksAxis) {
  CaseRig rig(case_arm(), case_skin(case_arm()));
  const std::size_t link = 2, ring_size = 32;
  std::mt19937 random(1);
  double greatest = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const DragCoefficients& drag = rig.at(test_arms::random_joints(rig.arm, random, 2.0));
    // Only this link's share: the links after it hang on the same joint.
    LinkSums alone{};
    alone[link] = rig.sensing.sums()[link];
    drag_coefficients(rig.arm, rig.X_WL, alone, {}, {}, rig.drag);
    double literal = 0.0;
    const std::size_t n = rig.layout.first[link + 1] - rig.layout.first[link];
    const auto sides = static_cast<std::size_t>(std::floor(std::numbers::pi / std::asin(0.0099 / 0.1))) + 1;
    ASSERT_EQ(n % sides, 0U);
    ASSERT_EQ(sides, ring_size);
    const double K = static_cast<double>(n / sides - 1);
    rig.for_link(link, [&](std::size_t s, const Eigen::Vector3d&, double omega) {
      const double k = static_cast<double>((s - rig.layout.first[link]) / sides);
      const double r = 0.05 + (0.03 - 0.05) * k / K;
      literal += r * r * omega;
    });
    EXPECT_NEAR(drag.plus[link - 1], literal, 1e-9 * literal + 1e-15);
    greatest = std::max(greatest, literal);
  }
  EXPECT_GT(greatest, 0.0);
}

/// Case b(i), a link across its joint (5.34): sensors on the link's axis at (k/K)·SL from the joint.
TEST(AppendixC, LinkOrthogonalToItsJoint) {
  const SerialArm arm = case_arm();
  const std::size_t link = 4, K = 60;
  AxisSensors axis;
  const auto [start, end] = arm.link_axis_m(link);
  const geometry::Pose X_frame_link = arm.find_frame("link_4")->second.inverse();
  axis.from_m = X_frame_link * start, axis.to_m = X_frame_link * end;
  axis.count = static_cast<int>(K);
  CaseRig rig(arm, {{"link_4", {}, {axis}, {}}});
  std::mt19937 random(2);
  double greatest = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const DragCoefficients& drag = rig.at(test_arms::random_joints(rig.arm, random, 2.0));
    double literal = 0.0;
    rig.for_link(link, [&](std::size_t s, const Eigen::Vector3d&, double omega) {
      const double k = static_cast<double>(s - rig.layout.first[link] + 1);
      const double arm_of_drag = k / static_cast<double>(K) * 0.3;
      literal += omega * arm_of_drag * arm_of_drag;
    });
    EXPECT_NEAR(drag.plus[link - 1], literal, 1e-9 * literal + 1e-15);
    greatest = std::max(greatest, literal);
  }
  EXPECT_GT(greatest, 0.0);
}

/// Any axis (5.35, 5.36, c.14–c.16): the foot I of the normal on the axis; with sensors on the links' axes in
/// one plane with the joint's, sin ξ times the way along the links.
TEST(AppendixC, SpinAboutAGeneralisedAxis) {
  CaseRig rig(case_arm(), case_skin(case_arm()));
  std::mt19937 random(3);
  double greatest = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const DragCoefficients& drag = rig.at(test_arms::random_joints(rig.arm, random, 2.0));
    for (std::size_t l = 0; l < 4; ++l) {
      const Eigen::Vector3d a1 = rig.arm.axis_point_W(l, rig.X_WL), along = rig.arm.axis_W(l, rig.X_WL);
      double literal = 0.0;
      for (std::size_t u = l + 1; u <= 4; ++u) {
        rig.for_link(u, [&](std::size_t, const Eigen::Vector3d& p, double omega) {
          const Eigen::Vector3d foot = a1 + along * along.dot(p - a1);
          literal += omega * (p - foot).squaredNorm();
        });
      }
      EXPECT_NEAR(drag.plus[l], literal, 1e-9 * literal + 1e-15) << "joint " << l;
      greatest = std::max(greatest, literal);
    }
  }
  EXPECT_GT(greatest, 0.0);
}

TEST(AppendixC, LinksInAPlaneWithTheAxisBySinesOfTheirAngles) {
  // A spinning post, then two links tilted away from it in one plane: ξ₁ = 0.5, ξ₂ = 0.5 + q₂.
  const double xi = 0.5, L1 = 0.3, L2 = 0.4;
  const int K = 40;
  std::vector<DhRow> rows(3);
  for (std::size_t i = 0; i < 3; ++i) {
    rows[i].link = "link_" + std::to_string(i + 1);
    rows[i].lower = -3.0, rows[i].upper = 3.0, rows[i].max_speed = rows[i].max_effort = 1.0;
  }
  rows[0].alpha_rad = std::numbers::pi / 2;
  rows[1].theta_rad = std::numbers::pi / 2 - xi, rows[1].a_m = L1;  // angle from the vertical is ξ₁ − q₂
  rows[2].a_m = L2;
  CaseRig rig(*SerialArm::from_dh(rows, DhConvention::kClassic, test_arms::at(0.05, 0.05, 0.45)), [&] {
    AxisSensors first, second;
    first.from_m = {-L1, 0, 0}, first.count = K;
    second.from_m = {-L2, 0, 0}, second.count = K;
    return std::vector<LinkSkin>{{"link_2", {}, {first}, {}}, {"link_3", {}, {second}, {}}};
  }());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  double greatest = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const JointArray q{3 * any(random), any(random), any(random)};
    const DragCoefficients& drag = rig.at(q);
    const double xi1 = xi - q[1], xi2 = xi1 - q[2];
    double literal = 0.0;
    rig.for_link(2, [&](std::size_t s, const Eigen::Vector3d&, double omega) {
      const double k = static_cast<double>(s - rig.layout.first[2] + 1);
      literal += omega * std::pow(std::sin(xi1) * k / K * L1, 2);  // c.14
    });
    rig.for_link(3, [&](std::size_t s, const Eigen::Vector3d&, double omega) {
      const double k = static_cast<double>(s - rig.layout.first[3] + 1);
      literal += omega * std::pow(std::sin(xi1) * L1 + std::sin(xi2) * k / K * L2, 2);  // c.16
    });
    EXPECT_NEAR(drag.plus[0], literal, 1e-9 * literal + 1e-15);
    greatest = std::max(greatest, literal);
  }
  EXPECT_GT(greatest, 0.0);
}

/// Base joint (c.19, c.20): its axis is vertical, so distances are those of the projections on the floor.
TEST(AppendixC, BaseJointByProjectionOnTheFloor) {
  CaseRig rig(case_arm(), case_skin(case_arm()));
  std::mt19937 random(5);
  double greatest = 0.0;
  for (int trial = 0; trial < 30; ++trial) {
    const DragCoefficients& drag = rig.at(test_arms::random_joints(rig.arm, random, 2.0));
    double literal = 0.0;
    for (std::size_t u = 1; u <= 4; ++u) {
      rig.for_link(u, [&](std::size_t, const Eigen::Vector3d& p, double omega) {
        literal += omega * (std::pow(p.x() + 0.25, 2) + std::pow(p.y() + 0.05, 2));
      });
    }
    EXPECT_NEAR(drag.plus[0], literal, 1e-9 * literal + 1e-15);
    greatest = std::max(greatest, literal);
  }
  EXPECT_GT(greatest, 0.0);
}

/// Translation (c.12, c.13): every sensor moves at V, whatever its place.
TEST(AppendixC, Translation) {
  CaseRig rig(test_arms::suspended(), test_worlds::tubes());
  std::mt19937 random(6);
  double greatest = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    const DragCoefficients& drag = rig.at(test_arms::random_joints(rig.arm, random, 2.0));
    double literal = 0.0;
    for (std::size_t u = 1; u <= 7; ++u) {
      rig.for_link(u, [&](std::size_t, const Eigen::Vector3d&, double omega) { literal += omega; });
    }
    EXPECT_NEAR(drag.plus[0], literal, 1e-9 * literal + 1e-15);
    greatest = std::max(greatest, literal);
  }
  EXPECT_GT(greatest, 0.0);
}

/// Power that drag takes, from positions before and after a short time (c.3–c.7): Σ μ|v|² = vᵀDv.
TEST(DragEnergy, IsWhatMovingTheSensorsThroughTheFluidCosts) {
  CaseRig rig(test_arms::suspended(), test_worlds::tubes(), Normalisation::kArea);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 10; ++trial) {
    const JointArray q = test_arms::random_joints(rig.arm, random, 2.0);
    JointArray v{}, before = q, after = q;
    const double h = 1e-6;
    for (std::size_t i = 0; i < 7; ++i) v[i] = normal(random), before[i] -= h * v[i], after[i] += h * v[i];
    LinkPoses X_before, X_after;
    rig.arm.link_poses(before, X_before);
    rig.arm.link_poses(after, X_after);
    const DragCoefficients& drag = rig.at(q);
    double dissipated = 0.0, quadratic = 0.0, by_torque = 0.0;
    for (std::size_t link = 1; link <= 7; ++link) {
      rig.for_link(link, [&](std::size_t s, const Eigen::Vector3d&, double omega) {
        const Eigen::Vector3d p = rig.layout.position(s);
        dissipated += omega * ((X_after[link] * p - X_before[link] * p) / (2 * h)).squaredNorm();
      });
    }
    const JointArray torque = drag_torque(drag, DragMode::kCoupled, v, 7);
    for (std::size_t i = 0; i < 7; ++i) {
      by_torque -= torque[i] * v[i];
      for (std::size_t j = 0; j < 7; ++j) quadratic += v[i] * drag.matrix(i, j) * v[j];
    }
    EXPECT_NEAR(quadratic, dissipated, 1e-6 * dissipated + 1e-12);
    EXPECT_NEAR(by_torque, dissipated, 1e-6 * dissipated + 1e-12);
  }
}

// ---- directional drag on a way there and back

/// Torques times velocity on the way from `far` to `near`, and back the same way.
struct ThereAndBack {
  double approach = 0.0, retreat = 0.0;
};

ThereAndBack reach(CaseRig& rig, const JointArray& far, const JointArray& near, bool directional,
                   DragMode mode) {
  ThereAndBack power;
  const int steps = 60;
  const DirectionalLaw law{.enabled = directional};
  for (int i = 0; i <= steps; ++i) {
    JointArray q{}, v{};
    for (std::size_t j = 0; j < q.size(); ++j) {
      q[j] = far[j] + (near[j] - far[j]) * i / steps;
      v[j] = near[j] - far[j];
    }
    const DragCoefficients drag = rig.at(q, law);
    const JointArray there = drag_torque(drag, mode, v, rig.arm.joint_count());
    for (double& speed : v) speed = -speed;
    const JointArray back = drag_torque(drag, mode, v, rig.arm.joint_count());
    for (std::size_t j = 0; j < rig.arm.joint_count(); ++j) {
      power.approach +=
          there[j] * v[j];  // v is turned round by now: positive where drag opposes the approach
      power.retreat -= back[j] * v[j];
    }
  }
  return power;
}

/// The suspended arm's whole skin nears one of the balls, by one joint at a time: swung at the shoulder and
/// at the elbow, and carried by the gantry.
TEST(DirectionalDrag, LeavingTheWayItCameCostsLessThanATenthAndTheSameWhenSymmetric) {
  CaseRig rig(test_arms::suspended(test_arms::at(0.1, 0.1, 1.75)), test_worlds::tubes(),
              Normalisation::kArea);
  int ways = 0;
  std::mt19937 random(8);
  for (int trial = 0; trial < 400; ++trial) {
    const JointArray near = test_arms::random_joints(rig.arm, random, 2.0);
    const std::size_t joint = random() % 4;
    JointArray far = near;
    far[joint] += (joint == 0 ? 0.15 : 0.3) * (random() % 2 == 0 ? 1.0 : -1.0);
    const auto mu_at = [&](const JointArray& q) {
      rig.at(q);
      double sum = 0.0;
      for (std::size_t link = joint + 1; link <= 7; ++link) sum += rig.sensing.sums()[link].mu;
      return sum;
    };
    if (mu_at(far) > 1e-6 || !(mu_at(near) > 1e-2)) continue;
    ++ways;
    for (const DragMode mode : {DragMode::kSeparable, DragMode::kCoupled}) {
      const ThereAndBack symmetric = reach(rig, far, near, false, mode);
      EXPECT_DOUBLE_EQ(symmetric.retreat, symmetric.approach);
      const ThereAndBack directional = reach(rig, far, near, true, mode);
      EXPECT_LE(directional.approach, symmetric.approach * (1 + 1e-12));
      EXPECT_GT(directional.approach, 0.9 * symmetric.approach);
      EXPECT_LT(directional.retreat, 0.1 * directional.approach);
    }
  }
  EXPECT_GT(ways, 5);
}

}  // namespace
}  // namespace phantom::robot
