#include "common/teleop/guards/feedback_observer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace feedback_observer_test {

constexpr double kTick_s = 0.002, kInertia = 5.0, kMaxSpeed = 1.2, kEffort_Nm = 200.0;

robot::SerialArm one_joint() {
  robot::DhRow row;
  row.link = "l";
  row.joint = "j";
  row.a_m = 1.0;
  row.lower = -10.0;
  row.upper = 10.0;
  row.max_speed = kMaxSpeed;
  row.max_effort = kEffort_Nm;
  // Its axis lies level, so that weight acts on it.
  return *robot::SerialArm::from_dh({row}, robot::DhConvention::kClassic,
                                    {geometry::rotation_from_rpy(std::numbers::pi / 2, 0, 0), {0, 0, 0}});
}

/// A joint on its own under a torque and what the surroundings do, seen by the observer.
struct ObserverRig {
  explicit ObserverRig(double payload_kg = 0.0)
      : observer(arm, {.dynamics = {.lag_s = 0.01,
                                    .threshold_Nm = {10.0},
                                    .coulomb_Nm = {2.0},
                                    .viscous_Nms_per_rad = {5.0},
                                    .slow_rad_s = {0.012},
                                    .inertia_kg_m2 = {kInertia},
                                    .coupled = false},
                       .inertia_kg_m2 = {kInertia},
                       .max_payload_kg = payload_kg,
                       .tip_m = {1.0, 0.0, 0.0}}) {
    arm.link_poses({q}, X_WL);
  }

  void tick(double torque_Nm) {
    const double friction_Nm = std::abs(v) > 1e-3 ? std::copysign(2.0, v) + 5.0 * v : 0.0;
    v += kTick_s * (torque_Nm - friction_Nm + external_Nm(q, v)) / inertia;
    q += kTick_s * v;
    arm.link_poses({q}, X_WL);
    const DriveMotion motion{true, {mirrored ? -v : v}, {torque_Nm}};
    const test::HeapGuard guard;
    found = observer.step(X_WL, {mirrored ? -q : q}, motion, kTick_s);
  }
  /// Returns whether nothing is found while `torque_Nm` acts for so long.
  bool is_believed(double for_s, const std::function<double(double)>& torque_Nm) {
    for (double t = 0.0; t < for_s; t += kTick_s) {
      tick(torque_Nm(t));
      if (found.joint >= 0) return false;
    }
    return true;
  }

  robot::SerialArm arm = one_joint();
  FeedbackObserver observer;
  robot::LinkPoses X_WL;
  UnexplainedEnergy found;
  std::function<double(double, double)> external_Nm = [](double, double) { return 0.0; };
  double q = 0.0, v = 0.0, inertia = kInertia;
  bool mirrored = false;
};

TEST(FeedbackObserver, SR12_MirroredFeedbackIsFoundBeforeTheJointIsAtItsGreatestSpeed) {
  ObserverRig rig;
  ASSERT_TRUE(rig.is_believed(0.5, [](double) { return 0.0; }));
  rig.mirrored = true;
  EXPECT_FALSE(rig.is_believed(1.0, [](double) { return 100.0; }));
  EXPECT_EQ(rig.found.joint, 0);
  EXPECT_GT(rig.found.seen_J, rig.found.allowed_J);
  EXPECT_LT(std::abs(rig.v), 0.75 * kMaxSpeed);
}

TEST(FeedbackObserver, OrdinaryMotionIsBelievedAlsoOfAnArmThatIsHeavierOrLighterThanKnown) {
  for (const double share : {0.7, 1.0, 1.4}) {
    ObserverRig rig;
    rig.inertia = share * kInertia;
    EXPECT_TRUE(rig.is_believed(20.0, [](double t) { return 60.0 * std::sin(6.0 * t); })) << share;
  }
}

// A stiff and a soft body, pressed for long and released: what they give back they took.
TEST(FeedbackObserver, ContactsAreBelievedAlsoAsTheyPushBack) {
  for (const double stiffness : {1e3, 2e4}) {
    ObserverRig rig;
    rig.external_Nm = [&](double q, double v) {
      return q > 0.05 ? std::min(0.0, -stiffness * (q - 0.05) - 20.0 * v) : 0.0;
    };
    EXPECT_TRUE(rig.is_believed(20.0, [](double t) { return 100.0 * std::sin(0.8 * t); })) << stiffness;
  }
}

TEST(FeedbackObserver, AnUnknownPayloadIsBelievedAsItIsLiftedAndLowered) {
  ObserverRig rig(10.0);
  rig.external_Nm = [](double q, double) { return -9.0 * 9.81 * std::cos(q); };
  rig.inertia = kInertia + 9.0;
  EXPECT_TRUE(rig.is_believed(30.0, [&](double t) {
    const double wanted = 0.6 * std::sin(1.2 * t);
    return 9.0 * 9.81 * std::cos(rig.q) + 300.0 * (wanted - rig.q) +
           120.0 * (0.72 * std::cos(1.2 * t) - rig.v);
  }));
}

// A velocity of the wrong sign alone is for the check of velocity and position; so is one that is noise.
TEST(FeedbackObserver, AVelocityThatDoesNotFitItsPositionIsNoEnergy) {
  for (const bool noise : {false, true}) {
    ObserverRig rig;
    double sign = -1.0;
    ASSERT_TRUE(rig.is_believed(0.1, [](double) { return 0.0; }));
    for (int i = 0; i < 150; ++i) {  // by then it is found
      rig.v += kTick_s * 60.0 * std::sin(0.012 * i) / kInertia;
      rig.q += kTick_s * rig.v;
      sign = noise ? -sign : sign;
      const DriveMotion motion{true, {noise ? 20.0 * sign : -rig.v}, {60.0 * std::sin(0.012 * i)}};
      ASSERT_EQ(rig.observer.step(rig.X_WL, {rig.q}, motion, kTick_s).joint, -1)
          << noise << ' ' << i << ' ' << rig.observer.energy_J(0);
    }
  }
}

TEST(FeedbackObserver, ItStartsOverWhereTheDrivesDoNotAnswer) {
  ObserverRig rig;
  rig.mirrored = true;
  rig.is_believed(0.05, [](double) { return 100.0; });
  ASSERT_NE(rig.observer.energy_J(0), 0.0);
  rig.observer.step(rig.X_WL, {}, {}, kTick_s);
  EXPECT_EQ(rig.observer.energy_J(0), 0.0);
}

}  // namespace feedback_observer_test
}  // namespace phantom::teleop
