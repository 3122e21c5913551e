// The observers of an arm that moves under water and through its surface: its drives exert what the equation
// of motion asks for, so no force is from outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/robot/kinematics/arm_dynamics.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "common/teleop/guards/feedback_observer.hpp"
#include "common/teleop/guards/momentum_observer.hpp"

namespace phantom::teleop::buoyant_observer_test {
namespace {

using core::JointArray;
constexpr double kTick_s = 1e-4;

const robot::SerialArm& arm() {
  static const robot::SerialArm made = robot::test_arms::suspended();
  return made;
}

/// Water to 1.1 m, which cuts the arm; links three times as heavy as it.
robot::Buoyancy in_water() {
  robot::MediumRegion water;
  water.density_kg_per_m3 = 1000.0;
  water.max_m.z() = 1.1;
  robot::DisplacedParts parts;
  for (std::size_t link = 1; link <= arm().joint_count(); ++link) {
    const robot::Link& body = arm().links()[link];
    for (const double side : {-1.0, 1.0})
      parts[link].push_back(
          {body.centre_of_mass_m + side * Eigen::Vector3d(0.02, 0.0, 0.06), body.mass_kg / 6000.0, 0.1});
  }
  return {parts, {water}};
}

MomentumObserverParameters parameters(bool weight) {
  MomentumObserverParameters p{.lag_s = 0.01, .weight = weight};
  p.threshold_Nm.fill(0.3), p.slow_rad_s.fill(0.01), p.inertia_kg_m2.fill(0.1);
  return p;
}

/// Greatest residual, N·m or N, of observers that know of the water and of those that do not.
struct Residuals {
  double aware_Nm = 0.0, unaware_Nm = 0.0;
  bool aware_touches = false, unaware_touches = false;
};

Residuals swing(bool balanced) {
  const robot::Buoyancy water = in_water();
  robot::Payload carried;
  robot::add_body(carried, 7, 4.0, {0.0, 0.0, -0.1}, 0.01 * Eigen::Matrix3d::Identity());
  robot::add_displaced(carried, 7, 1.5e-3, {0.0, 0.0, -0.1});
  const MomentumObserverParameters known = parameters(!balanced);
  MomentumObserver aware(arm(), known, &water), unaware(arm(), known);
  Residuals found;
  robot::ArmMomentum before{};
  for (int i = 0; i < 10'000; ++i) {
    const double t = i * kTick_s;
    JointArray q{}, v{};
    for (std::size_t j = 0; j < arm().joint_count(); ++j) {
      q[j] = 0.2 * std::sin(3.0 * t + static_cast<double>(j));
      v[j] = 0.6 * std::cos(3.0 * t + static_cast<double>(j));
    }
    robot::LinkPoses X_WL;
    arm().link_poses(q, X_WL);
    const auto momentum = robot::momentum_of(arm(), known.inertia_kg_m2, X_WL, v, carried);
    JointArray torque = balanced ? JointArray{} : arm().gravity_torque(X_WL);
    robot::add_weight(arm(), carried, X_WL, torque);
    water.add_lift(arm(), X_WL, torque);
    water.add_lift(arm(), carried, X_WL, torque);
    for (std::size_t j = 0; j < arm().joint_count(); ++j)
      torque[j] += (i == 0 ? 0.0 : (momentum.momentum[j] - before.momentum[j]) / kTick_s) - momentum.drift[j];
    before = momentum;
    found.aware_touches |= aware.step(X_WL, {true, v, torque}, kTick_s, carried).contact;
    found.unaware_touches |= unaware.step(X_WL, {true, v, torque}, kTick_s, carried).contact;
    for (std::size_t j = 0; j < arm().joint_count(); ++j) {
      found.aware_Nm = std::max(found.aware_Nm, std::abs(aware.residual_Nm()[j]));
      found.unaware_Nm = std::max(found.unaware_Nm, std::abs(unaware.residual_Nm()[j]));
    }
  }
  return found;
}

TEST(BuoyantObserver, TakesTheLiftThatItKnowsForNoForceFromOutside) {
  for (const bool balanced : {false, true}) {
    const Residuals found = swing(balanced);
    EXPECT_LT(found.aware_Nm, 0.05) << balanced;
    EXPECT_FALSE(found.aware_touches);
    EXPECT_GT(found.unaware_Nm, 3.0) << "without knowing of it, it takes the lift for a contact";
    EXPECT_TRUE(found.unaware_touches);
  }
}

// A link that drifts up in the water gains energy that its drive did not give it, if the lift is not known.
TEST(BuoyantObserver, ARisingArmIsNoFalseFeedbackWhereItsLiftIsKnown) {
  const robot::SerialArm bar = robot::test_arms::load(
      robot::test_arms::link("base", 0, "0 0 0") + robot::test_arms::link("bar", 5, "0 0 0") +
          robot::test_arms::moving_joint("lift", "prismatic", "base", "bar", "0 0 0", "0 0 0", "0 0 1", 2),
      "bar");
  robot::MediumRegion water;
  water.density_kg_per_m3 = 1000.0;
  robot::DisplacedParts parts;
  parts[1] = {{Eigen::Vector3d::Zero(), 0.02, 0.1}};  // 20 kg of water lift 5 kg
  const robot::Buoyancy buoyancy(parts, {water});
  FeedbackObserverParameters known{.dynamics = parameters(true), .energy_share = 0.25};
  known.inertia_kg_m2.fill(5.1);
  FeedbackObserver aware(bar, known, &buoyancy), unaware(bar, known);
  bool aware_found = false, unaware_found = false;
  JointArray q{}, v{};
  for (int i = 0; i < 1000; ++i) {
    constexpr double kPeriod_s = 0.001;
    const double a_m_s2 = robot::kGravity_m_s2 * 15.0 / 5.1;  // of rotor and bar
    v[0] = a_m_s2 * i * kPeriod_s, q[0] = 0.5 * a_m_s2 * std::pow(i * kPeriod_s, 2);
    if (v[0] > bar.joints()[0].max_speed) break;
    robot::LinkPoses X_WL;
    bar.link_poses(q, X_WL);
    aware_found |= aware.step(X_WL, q, {true, v, {}}, kPeriod_s).joint >= 0;
    unaware_found |= unaware.step(X_WL, q, {true, v, {}}, kPeriod_s).joint >= 0;
  }
  EXPECT_FALSE(aware_found);
  EXPECT_TRUE(unaware_found);
}

}  // namespace
}  // namespace phantom::teleop::buoyant_observer_test
