// The gripper's law on a simulated gripper, and its promises for any input.
#include "common/teleop/gripper/gripper.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/simulation/gripper_plant.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr double kGripperTick_s = 0.001;
constexpr GripperLimits kGripperLimits{.widest_m = 0.1,
                                       .max_speed_m_s = 0.1,
                                       .least_force_N = 3.0,
                                       .greatest_force_N = 60.0,
                                       .usual_force_N = 30.0};
constexpr double kObject_m = 0.042, kStiffness_N_per_m = 20'000.0;

/// A gripper with its drive, in virtual time.
class GripperRig {
 public:
  explicit GripperRig(double object_m = kObject_m, double start_m = 0.1)
      : plant({.widest_m = kGripperLimits.widest_m,
               .object_width_m = object_m,
               .object_stiffness_N_per_m = kStiffness_N_per_m},
              start_m) {}

  void ask_width(double width_m) {
    request.width_m = width_m;
    ++request.width_number;
  }
  void ask_force(double force_N) {
    request.force_N = force_N;
    ++request.force_number;
  }
  void tick() {
    demand =
        control.step({true, plant.width_m(), plant.velocity_m_s(), plant.drive_force_N(), follows, !follows},
                     request, kGripperTick_s);
    // A drive that does not follow holds where it is, as by its quick stop: with the force that it had.
    if (follows) held_m = demand.width_m;
    plant.step(held_m, demand.force_N, kGripperTick_s);
    fastest_m_s = std::max(fastest_m_s, std::abs(plant.velocity_m_s()));
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds / kGripperTick_s); ++i) tick();
  }
  const GripperStatus& status() const { return control.status(); }

  simulation::GripperPlant plant;
  GripperControl control{kGripperLimits};
  GripperRequest request;
  GripperDemand demand;
  bool follows = true;
  double held_m = 0.1, fastest_m_s = 0.0;
};

TEST(GripperControl, StaysWhereItIsUntilItIsAsked) {
  GripperRig rig(0.0, 0.06);
  rig.run(1.0);
  EXPECT_NEAR(rig.plant.width_m(), 0.06, 1e-6);
  EXPECT_EQ(rig.status().requested_width_m, 0.06);
  EXPECT_FALSE(rig.status().holds || rig.status().moves || rig.status().open || rig.status().closed);
}

TEST(GripperControl, GoesToAWidthAtItsSpeed) {
  GripperRig rig(0.0);
  rig.ask_width(0.03);
  rig.run(0.35);
  EXPECT_TRUE(rig.status().moves);
  EXPECT_NEAR(rig.plant.width_m(), 0.1 - 0.35 * 0.1, 0.001);
  rig.run(0.65);
  EXPECT_NEAR(rig.plant.width_m(), 0.03, 1e-4);
  EXPECT_LT(rig.fastest_m_s, 1.05 * kGripperLimits.max_speed_m_s);
  EXPECT_FALSE(rig.status().holds || rig.status().moves);
}

TEST(GripperControl, OpensAndClosesAsFarAsItGoes) {
  GripperRig rig(0.0, 0.05);
  rig.ask_width(1.0);
  rig.run(1.0);
  EXPECT_TRUE(rig.status().open);
  EXPECT_EQ(rig.status().requested_width_m, 0.1);
  rig.ask_width(0.0);
  rig.run(1.5);
  EXPECT_TRUE(rig.status().closed);
  EXPECT_FALSE(rig.status().open || rig.status().holds);
}

TEST(GripperControl, HoldsWhatItMeetsWithTheRequestedForce) {
  GripperRig rig;
  rig.ask_force(20.0);
  rig.ask_width(0.0);
  rig.run(1.0);
  EXPECT_TRUE(rig.status().holds);
  EXPECT_FALSE(rig.status().moves);
  EXPECT_NEAR(rig.status().sense.force_N, 20.0, 1e-9);
  EXPECT_NEAR(rig.plant.object_force_N(), 20.0, 1.0 + 1e-6);  // the friction of the fingers
  EXPECT_NEAR(rig.plant.width_m(), kObject_m - 20.0 / kStiffness_N_per_m, 1.0 / kStiffness_N_per_m + 1e-6);
  rig.ask_force(40.0);  // firmer, while it holds
  rig.run(0.3);
  EXPECT_TRUE(rig.status().holds);
  EXPECT_NEAR(rig.plant.object_force_N(), 40.0, 1.0 + 1e-6);
}

// A bump on the way is no grip, and a grip that gives for a moment is still one.
TEST(GripperControl, WhatIsShortIsNotSaid) {
  GripperControl control(kGripperLimits);
  GripperRequest request{.width_number = 1, .width_m = 0.0};
  const GripperSense free{true, 0.05, 0.0, 0.0, true, false}, pressed{true, 0.05, 0.0, 30.0, true, false};
  const auto run = [&](const GripperSense& sense, double seconds) {
    for (int i = 0; i < std::lround(seconds / kGripperTick_s); ++i)
      control.step(sense, request, kGripperTick_s);
    return control.status().holds;
  };
  run(free, 0.01);
  EXPECT_FALSE(run(pressed, 0.09));
  EXPECT_FALSE(run(free, 0.2));
  EXPECT_TRUE(run(pressed, 0.11));
  EXPECT_TRUE(run(free, 0.09));
  EXPECT_TRUE(run(pressed, 0.2));
  EXPECT_FALSE(run(free, 0.11));
}

TEST(GripperControl, HoldsFromWithinToo) {
  GripperRig rig(0.0, 0.05);
  rig.ask_width(0.1);
  rig.run(0.2);
  // A ring that the fingers press open: the drive exerts its force and does not get on.
  const GripperSense ring{true, 0.07, 0.0, -30.0, true, false};
  for (int i = 0; i < 200; ++i) rig.control.step(ring, rig.request, kGripperTick_s);
  EXPECT_TRUE(rig.status().holds);
  rig.control.halt();
  EXPECT_EQ(rig.control.step(ring, rig.request, kGripperTick_s).width_m, 0.07 + GripperControl::kLead_m);
}

TEST(GripperControl, ForcesBeyondTheLimitsAreBroughtWithin) {
  GripperRig rig;
  rig.ask_force(1e6);
  rig.tick();
  EXPECT_EQ(rig.demand.force_N, kGripperLimits.greatest_force_N);
  rig.ask_force(0.0);
  rig.tick();
  EXPECT_EQ(rig.demand.force_N, kGripperLimits.least_force_N);
  rig.ask_force(std::numeric_limits<double>::quiet_NaN());
  rig.tick();
  EXPECT_EQ(rig.demand.force_N, kGripperLimits.least_force_N);
}

TEST(GripperControl, HaltEndsAMotionForGood) {
  GripperRig rig(0.0);
  rig.ask_width(0.0);
  rig.run(0.3);
  const double at_m = rig.plant.width_m();
  rig.control.halt();
  rig.run(2.0);
  EXPECT_NEAR(rig.plant.width_m(), at_m, GripperControl::kLead_m);
  EXPECT_FALSE(rig.status().moves);
  EXPECT_NEAR(rig.status().requested_width_m, at_m, GripperControl::kLead_m);
}

TEST(GripperControl, HaltLeavesAGripAsItIs) {
  for (const double until_s :
       {0.55, 0.58, 0.585, 0.59, 0.6, 0.65, 1.0}) {  // around the moment of the contact
    GripperRig rig;
    rig.ask_width(0.0);
    rig.run(until_s);
    const bool touched = rig.plant.object_force_N() > 15.0;
    rig.control.halt();
    rig.run(2.0);
    EXPECT_GE(rig.plant.object_force_N(), touched ? 15.0 : 0.0) << until_s;
    if (until_s >= 0.7) {
      EXPECT_TRUE(rig.status().holds);
      EXPECT_NEAR(rig.plant.object_force_N(), 30.0, 1.0 + 1e-6);
    }
  }
}

TEST(GripperControl, GripsAgainAfterAFaultOfItsDrive) {
  GripperRig rig;
  rig.ask_width(0.0);
  rig.run(1.0);
  rig.follows = false;
  rig.run(0.5);
  EXPECT_TRUE(rig.status().sense.fault);
  EXPECT_FALSE(rig.status().sense.follows);
  EXPECT_TRUE(rig.status().holds);
  rig.follows = true;
  rig.run(0.5);
  EXPECT_TRUE(rig.status().holds);
  EXPECT_NEAR(rig.plant.object_force_N(), 30.0, 1.0 + 1e-6);
}

TEST(GripperControl, DoesNotGoOnByItselfAfterAFault) {
  for (const double to_m : {0.0, 0.1}) {
    GripperRig rig(0.0, 0.05);
    rig.ask_width(to_m);
    rig.run(0.2);
    rig.follows = false;
    rig.run(0.1);
    const double at_m = rig.plant.width_m();
    rig.follows = true;
    rig.run(1.0);
    EXPECT_NEAR(rig.plant.width_m(), at_m, 1e-3) << to_m;
    EXPECT_NEAR(rig.status().requested_width_m, at_m, 1e-3) << to_m;
  }
}

TEST(GripperControl, CarriesOutARequestThatCameDuringAFault) {
  GripperRig rig(0.0, 0.05);
  rig.run(0.1);
  rig.follows = false;
  rig.run(0.1);
  rig.ask_width(0.08);
  rig.run(0.1);
  EXPECT_NEAR(rig.plant.width_m(), 0.05, 1e-3);
  rig.follows = true;
  rig.run(1.0);
  EXPECT_NEAR(rig.plant.width_m(), 0.08, 1e-3);
}

TEST(GripperControl, TakesOverTheGripOfAnEarlierProcess) {
  GripperControl control(kGripperLimits);
  GripperSense sense{true, 0.04, 0.0, 12.0, false, false};
  control.step(sense, {}, kGripperTick_s);
  sense.follows = true;
  GripperDemand demand;
  for (int i = 0; i < 200; ++i) demand = control.step(sense, {}, kGripperTick_s);
  EXPECT_EQ(demand.width_m, 0.04 - GripperControl::kLead_m);
  EXPECT_EQ(demand.force_N, 12.0);
  EXPECT_TRUE(control.status().holds);
}

TEST(GripperControl, ClosesOnWhatSlipsNoFasterThanItsSpeed) {
  GripperRig rig;
  rig.ask_width(0.0);
  rig.run(1.0);
  const double before_m = rig.plant.width_m();
  GripperRequest same = rig.request;
  GripperSense sense = rig.status().sense;
  double last_m = rig.demand.width_m;
  for (int i = 0; i < 300; ++i) {  // gone: the fingers follow the demand at once
    sense.width_m = last_m;
    sense.force_N = 0.0;
    const double next_m = rig.control.step(sense, same, kGripperTick_s).width_m;
    ASSERT_GE(next_m, last_m - kGripperLimits.max_speed_m_s * kGripperTick_s - 1e-12);
    last_m = next_m;
  }
  EXPECT_LT(last_m, before_m - 0.02);
  EXPECT_FALSE(rig.status().holds);
}

// Whatever halts and faults come: a grip stays, until somebody asks for another width.
TEST(GripperControl, NothingButARequestOpensAGrip) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> chance;
  for (int run = 0; run < 40; ++run) {
    GripperRig rig(0.01 + 0.08 * chance(random));
    rig.ask_force(5.0 + 50.0 * chance(random));
    rig.ask_width(0.0);
    rig.run(1.4);
    ASSERT_TRUE(rig.status().holds);
    const double most_N = rig.plant.object_force_N();
    for (int i = 0; i < 3000; ++i) {
      if (chance(random) < 0.005) rig.control.halt();
      if (chance(random) < 0.01) rig.follows = !rig.follows;
      rig.tick();
      ASSERT_GT(rig.plant.object_force_N(), 0.9 * most_N - 2.0) << run << ", tick " << i;
    }
  }
}

// For any readings and requests: the demand is finite and within the limits, leads by kLead_m at most, and
// moves no faster than its limit while the readings do not jump.
TEST(GripperControl, DemandIsWithinItsLimitsForAnyInput) {
  std::mt19937 random(11);
  const double odd[] = {0.0,
                        -1.0,
                        1.0,
                        0.05,
                        1e300,
                        -1e300,
                        std::numeric_limits<double>::infinity(),
                        0.02,
                        0.1,
                        60.0,
                        std::numeric_limits<double>::quiet_NaN()};
  const auto any = [&] { return odd[random() % std::size(odd)]; };
  GripperControl control(kGripperLimits);
  GripperRequest request;
  for (int i = 0; i < 200'000; ++i) {
    if (random() % 5 == 0) request.width_m = any(), ++request.width_number;
    if (random() % 5 == 0) request.force_N = any(), ++request.force_number;
    if (random() % 50 == 0) control.halt();
    const GripperSense sense{random() % 9 != 0, any(), any(), any(), random() % 4 != 0, random() % 7 == 0};
    const GripperDemand demand = control.step(sense, request, kGripperTick_s);
    ASSERT_TRUE(std::isfinite(demand.width_m) && std::isfinite(demand.force_N));
    ASSERT_GE(demand.force_N, kGripperLimits.least_force_N);
    ASSERT_LE(demand.force_N, kGripperLimits.greatest_force_N);
    const GripperStatus& status = control.status();
    ASSERT_TRUE(status.requested_width_m >= 0.0 && status.requested_width_m <= kGripperLimits.widest_m);
    if (status.sense.follows) {
      ASSERT_TRUE(demand.width_m >= 0.0 && demand.width_m <= kGripperLimits.widest_m);
    }
  }
}

TEST(GripperControl, StepDoesNotAllocate) {
  GripperRig rig;
  const test::HeapGuard guard;
  rig.ask_width(0.0);
  rig.run(1.0);
  rig.follows = false;
  rig.run(0.1);
  rig.follows = true;
  rig.ask_width(0.1);
  rig.run(1.0);
}

}  // namespace
}  // namespace phantom::teleop
