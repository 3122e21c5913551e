// The observer on an arm whose joints are coupled: the plant is Orocos KDL's mass matrix, Coriolis torques
// and weight, integrated in small steps; the observer sees samples of it, as drives report them.
#include "common/teleop/guards/momentum_observer.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/robot/tests/kdl_arm.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop::momentum_observer_test {
namespace {

using core::JointArray;
using robot::SerialArm;

constexpr double kPeriod_s = 0.002;
constexpr int kSubSteps = 20;
constexpr std::size_t kJoints = 7;
constexpr double kLag_s = 0.02;

const SerialArm& arm() {
  static const SerialArm made =
      robot::SerialArm::from_urdf(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/arm/suspended_arm.urdf", "tool",
                                  {})
          .value();
  return made;
}

/// The shipped arm with the shipped drives' inertia and friction, and threshold and lag of 5 % and 20 ms.
MomentumObserverParameters parameters() {
  MomentumObserverParameters p;
  p.lag_s = kLag_s;
  p.weight = true;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const robot::Joint& joint = arm().joints()[j];
    p.inertia_kg_m2[j] = joint.type == robot::JointType::kPrismatic ? 5.0 : 0.3;
    p.coulomb_Nm[j] = 0.01 * joint.max_effort;
    p.viscous_Nms_per_rad[j] = 0.03 * joint.max_effort / joint.max_speed;
    p.slow_rad_s[j] = 0.01 * joint.max_speed;
    p.threshold_Nm[j] = 0.05 * joint.max_effort;
  }
  return p;
}

/// The arm under computed torques that lead it along sines, with friction and a force at its tip. It may
/// carry a payload of which the observer knows nothing.
class Plant {
 public:
  explicit Plant(double payload_kg = 0.0)
      : known_(parameters()),
        loaded_(with_payload(payload_kg)),
        dynamics_(robot::kdl_chain(loaded_), {}, known_.inertia_kg_m2),
        expected_(robot::kdl_chain(arm()), {}, known_.inertia_kg_m2) {
    for (std::size_t j = 0; j < kJoints; ++j) {
      const robot::Joint& joint = arm().joints()[j];
      middle_[j] = 0.5 * (joint.lower + joint.upper) + 0.1 * (joint.upper - joint.lower);
    }
    q = middle_;
    arm().link_poses(q, X_WL);
  }

  /// Advances by a period. Returns what the drives report at its end.
  DriveMotion pass(double share_of_speed) {
    JointArray mean{};
    for (int k = 0; k < kSubSteps; ++k) {
      const double dt = kPeriod_s / kSubSteps;
      if (k == 0) torque_Nm = control(share_of_speed);
      arm().link_poses(q, X_WL);
      external_Nm = {};
      arm().add_force(kJoints, X_WL[kJoints] * Eigen::Vector3d(0.0, 0.0, -0.1), force_W_N, X_WL, external_Nm);
      Eigen::VectorXd rest = -dynamics_.coriolis(q, v) - dynamics_.weight(q);
      for (std::size_t j = 0; j < kJoints; ++j)
        rest[static_cast<Eigen::Index>(j)] += torque_Nm[j] + external_Nm[j] - friction_Nm(j);
      const Eigen::VectorXd a = dynamics_.mass(q).ldlt().solve(rest);
      for (std::size_t j = 0; j < kJoints; ++j) {
        v[j] += dt * a[static_cast<Eigen::Index>(j)];
        q[j] += dt * v[j];
        mean[j] += torque_Nm[j] / kSubSteps;
      }
    }
    time_s += kPeriod_s;
    arm().link_poses(q, X_WL);
    return {true, v, mean};
  }

  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();
  JointArray q{}, v{}, torque_Nm{}, external_Nm{};
  robot::LinkPoses X_WL;
  double time_s = 0.0;
  double fastest = 0.0;  // greatest speed wanted of a joint ÷ its greatest speed

 private:
  static SerialArm with_payload(double payload_kg) {
    SerialArm loaded = arm();
    const_cast<robot::Link&>(loaded.links()[kJoints])
        .add_body(payload_kg, {0.0, 0.0, -0.1}, Eigen::Matrix3d::Zero());
    return loaded;
  }
  double friction_Nm(std::size_t j) const {
    return known_.coulomb_Nm[j] * std::tanh(v[j] / known_.slow_rad_s[j]) +
           known_.viscous_Nms_per_rad[j] * v[j];
  }
  JointArray control(double share) {
    Eigen::VectorXd wanted(static_cast<Eigen::Index>(kJoints));
    for (std::size_t j = 0; j < kJoints; ++j) {
      const robot::Joint& joint = arm().joints()[j];
      const double rate = 2.0 * std::numbers::pi * (0.25 + 0.07 * static_cast<double>(j));
      const double swing = std::min(0.3 * (joint.upper - joint.lower), share * joint.max_speed / rate);
      const double at = rate * time_s;
      const double q_ref = middle_[j] + swing * (1.0 - std::cos(at)), v_ref = swing * rate * std::sin(at),
                   a_ref = swing * rate * rate * std::cos(at);
      fastest = std::max(fastest, std::abs(v[j]) / joint.max_speed);
      wanted[static_cast<Eigen::Index>(j)] = a_ref + 2500.0 * (q_ref - q[j]) + 100.0 * (v_ref - v[j]);
    }
    const Eigen::VectorXd tau = expected_.mass(q) * wanted + expected_.coriolis(q, v) + expected_.weight(q);
    JointArray torque{};
    for (std::size_t j = 0; j < kJoints; ++j) torque[j] = tau[static_cast<Eigen::Index>(j)] + friction_Nm(j);
    return torque;
  }

  MomentumObserverParameters known_;
  SerialArm loaded_;
  robot::KdlDynamics dynamics_, expected_;
  JointArray middle_{};
};

/// Greatest |a − b| ÷ the joint's effort.
double apart(const JointArray& a, const JointArray& b) {
  double most = 0.0;
  for (std::size_t j = 0; j < kJoints; ++j)
    most = std::max(most, std::abs(a[j] - b[j]) / arm().joints()[j].max_effort);
  return most;
}

// Step by step the residual is the external torque behind a low-pass of the stated lag, while the arm moves
// at full speed in all joints.
TEST(MomentumObserver, FollowsAForceOnTheMovingToolAsALowPassOfTheStatedLag) {
  Plant plant;
  MomentumObserver observer(arm(), parameters());
  JointArray low_pass{};
  double worst = 0.0, largest = 0.0;
  for (int i = 0; i < 2000; ++i) {
    plant.force_W_N = i < 500 || i > 1500 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(60.0, -80.0, 40.0);
    const DriveMotion motion = plant.pass(1.0);
    observer.step(plant.X_WL, motion, kPeriod_s);
    for (std::size_t j = 0; j < kJoints; ++j)
      low_pass[j] += kPeriod_s / (kLag_s + kPeriod_s) * (plant.external_Nm[j] - low_pass[j]);
    worst = std::max(worst, apart(observer.residual_Nm(), low_pass));
    largest = std::max(largest, apart(plant.external_Nm, {}));
  }
  EXPECT_GT(plant.fastest, 0.8);
  EXPECT_GT(largest, 0.3);
  EXPECT_LT(worst, 0.01) << "of the joints' effort";
}

TEST(MomentumObserver, AfterThreeLagsAForceIsKnownLessTheThreshold) {
  Plant plant;
  MomentumObserver observer(arm(), parameters());
  const double lag_cycles = kLag_s / kPeriod_s;
  for (int i = 0; i < 500; ++i) observer.step(plant.X_WL, plant.pass(0.3), kPeriod_s);
  plant.force_W_N = {90.0, 60.0, 0.0};
  int contact_after = -1;
  ExternalTorque felt;
  for (int i = 0; i < 4 * lag_cycles; ++i) {
    felt = observer.step(plant.X_WL, plant.pass(0.3), kPeriod_s);
    if (felt.contact && contact_after < 0) contact_after = i + 1;
  }
  EXPECT_LE(contact_after, lag_cycles);
  EXPECT_GT(contact_after, 0);
  int above = 0;
  for (std::size_t j = 0; j < kJoints; ++j) {
    const double threshold = parameters().threshold_Nm[j], real = plant.external_Nm[j];
    const double expected = real - std::clamp(real, -threshold, threshold);
    above += expected != 0.0;
    EXPECT_NEAR(felt.torque_Nm[j], expected, 0.05 * std::abs(real) + 0.01 * threshold) << j;
  }
  EXPECT_GE(above, 2);
  plant.force_W_N.setZero();
  int gone_after = 0;
  while (observer.step(plant.X_WL, plant.pass(0.3), kPeriod_s).contact && gone_after < 1000) ++gone_after;
  EXPECT_LT(gone_after * kPeriod_s, 4 * kLag_s + ContactLatch::kHold_s);
}

TEST(MomentumObserver, FreeMotionAtFullSpeedIsNoContact) {
  Plant plant;
  MomentumObserver observer(arm(), parameters());
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const ExternalTorque felt = observer.step(plant.X_WL, plant.pass(1.0), kPeriod_s);
    EXPECT_FALSE(felt.contact);
    EXPECT_EQ(felt.torque_Nm, JointArray{});
    worst = std::max(worst, apart(observer.residual_Nm(), {}));
  }
  EXPECT_GT(plant.fastest, 0.8);
  EXPECT_LT(worst, 0.01) << "a fifth of the threshold";
}

// What a model without the coupling between the joints would have said of that motion.
TEST(MomentumObserver, WithoutTheCouplingFreeMotionLooksLikeContact) {
  Plant plant;
  MomentumObserverParameters alone = parameters();
  alone.coupled = false;
  MomentumObserver observer(arm(), alone);
  bool contact = false;
  for (int i = 0; i < 2000; ++i)
    contact = observer.step(plant.X_WL, plant.pass(1.0), kPeriod_s).contact || contact;
  EXPECT_TRUE(contact);
}

// A tool that is a tenth heavier than the model: below the threshold. An unknown payload of 10 kg is seen for
// what it is, a force on the arm.
TEST(MomentumObserver, AnUnknownPayloadIsAForce) {
  for (const double payload_kg : {0.2, 10.0}) {
    bool contact = false;
    for (const double share_of_speed : {0.5, 0.0}) {
      Plant plant(payload_kg);
      MomentumObserver observer(arm(), parameters());
      for (int i = 0; i < 2000; ++i)
        contact = observer.step(plant.X_WL, plant.pass(share_of_speed), kPeriod_s).contact || contact;
      if (share_of_speed > 0.0) continue;
      JointArray weight{};
      arm().add_force(kJoints, plant.X_WL[kJoints] * Eigen::Vector3d(0.0, 0.0, -0.1),
                      {0.0, 0.0, -9.80665 * payload_kg}, plant.X_WL, weight);
      EXPECT_LT(apart(observer.residual_Nm(), weight), 0.003) << payload_kg;
    }
    EXPECT_EQ(contact, payload_kg > 1.0) << payload_kg;
  }
}

// ---- the joints on their own: what the observer does with its samples

/// One joint of 2 kg·m² and no friction.
struct OneJoint {
  OneJoint() {
    parameters.coupled = false;
    parameters.lag_s = kLag_s;
    parameters.slow_rad_s.fill(0.01);
    parameters.inertia_kg_m2.fill(2.0);
    parameters.threshold_Nm.fill(5.0);
  }
  MomentumObserverParameters parameters;
  robot::LinkPoses X_WL;
};

TEST(MomentumObserver, StartsAtRestWithoutAJumpWhateverTheSpeed) {
  OneJoint one;
  MomentumObserver observer(arm(), one.parameters);
  DriveMotion motion{.usable = true};
  motion.velocity.fill(3.0);
  int silent = 0;
  for (int i = 0; i < 100; ++i) {
    const ExternalTorque felt = observer.step(one.X_WL, motion, kPeriod_s);
    silent += felt.measured ? 0 : 1;
    EXPECT_LT(apart(observer.residual_Nm(), {}), 1e-12);
    EXPECT_FALSE(felt.contact);
  }
  EXPECT_NEAR(silent * kPeriod_s, MomentumObserver::kSettleLags * kLag_s, 1.5 * kPeriod_s);
}

// Held fast: the drives' torque is borne by the surroundings.
TEST(MomentumObserver, SaysNothingOfSamplesThatAreMissingOrNoNumbersAndStartsAnew) {
  OneJoint one;
  const double nan = std::nan("");
  for (const int fault : {0, 1, 2}) {
    MomentumObserver observer(arm(), one.parameters);
    DriveMotion motion{.usable = true};
    motion.torque_Nm.fill(50.0);
    for (int i = 0; i < 100; ++i) observer.step(one.X_WL, motion, kPeriod_s);
    ExternalTorque felt = observer.step(one.X_WL, motion, kPeriod_s);
    ASSERT_TRUE(felt.measured && felt.contact);
    EXPECT_NEAR(felt.torque_Nm[3], -45.0, 0.5);
    DriveMotion bad = motion;
    if (fault == 0) bad.usable = false;
    if (fault == 1) bad.velocity[2] = nan;
    if (fault == 2) bad.torque_Nm[6] = nan;
    felt = observer.step(one.X_WL, bad, kPeriod_s);
    EXPECT_FALSE(felt.measured || felt.contact);
    EXPECT_EQ(felt.torque_Nm, JointArray{});
    felt = observer.step(one.X_WL, motion, kPeriod_s);
    EXPECT_FALSE(felt.measured) << "the one after is a start";
    for (int i = 0; i < 100; ++i) felt = observer.step(one.X_WL, motion, kPeriod_s);
    EXPECT_TRUE(felt.measured && felt.contact);
    EXPECT_NEAR(felt.torque_Nm[3], -45.0, 0.5);
  }
}

// Continuous, and never steeper than the torque itself: it cannot make a loop over it unstable that would be
// stable without it.
TEST(MomentumObserver, TheThresholdIsSoft) {
  OneJoint one;
  MomentumObserver observer(arm(), one.parameters);
  DriveMotion motion{.usable = true};
  double before = 0.0, residual_before = 0.0;
  for (int i = 0; i < 5000; ++i) {
    motion.torque_Nm[2] = 12.0 * std::sin(0.002 * i);
    const double felt = observer.step(one.X_WL, motion, kPeriod_s).torque_Nm[2];
    const double residual = observer.residual_Nm()[2];
    if (i > 100) {
      EXPECT_LE(std::abs(felt - before), std::abs(residual - residual_before) + 1e-12);
      EXPECT_EQ(felt == 0.0, std::abs(residual) <= 5.0);
      EXPECT_NEAR(std::abs(felt), std::max(0.0, std::abs(residual) - 5.0), 1e-12);
    }
    before = felt;
    residual_before = residual;
  }
}

TEST(MomentumObserver, ContactDoesNotFlickerAtTheThreshold) {
  OneJoint one;
  MomentumObserver observer(arm(), one.parameters);
  DriveMotion motion{.usable = true};
  int changes = 0;
  bool contact = false;
  for (int i = 0; i < 5000; ++i) {  // 4.6 to 5.4 N·m every 0.13 s
    motion.torque_Nm[0] = 5.0 + 0.4 * std::sin(0.1 * i);
    const bool now = observer.step(one.X_WL, motion, kPeriod_s).contact;
    changes += now != contact;
    contact = now;
  }
  EXPECT_EQ(changes, 1);
}

// Of a loop that comes late, and of none.
TEST(MomentumObserver, AnyTimeBetweenSamplesIsTakenAsItIs) {
  OneJoint one;
  MomentumObserver observer(arm(), one.parameters);
  DriveMotion motion{.usable = true};
  motion.torque_Nm.fill(20.0);
  for (int i = 0; i < 400; ++i) {
    const double dt_s = i % 7 == 0 ? 0.09 : i % 5 == 0 ? 0.0 : kPeriod_s;
    for (std::size_t j = 0; j < kJoints; ++j) motion.velocity[j] += dt_s * 30.0 / 2.0;  // 10 N·m push as well
    observer.step(one.X_WL, motion, dt_s);
  }
  for (std::size_t j = 0; j < kJoints; ++j) EXPECT_NEAR(observer.residual_Nm()[j], 10.0, 1e-6);
}

TEST(MomentumObserver, UsesNoHeap) {
  Plant plant;
  MomentumObserver observer(arm(), parameters());
  const DriveMotion motion = plant.pass(1.0);
  const test::HeapGuard guard;
  for (int i = 0; i < 100; ++i) observer.step(plant.X_WL, motion, kPeriod_s);
}

}  // namespace
}  // namespace phantom::teleop::momentum_observer_test
