// Loose objects that lie, tip, are gripped, carried and dropped, against statics.
#include "common/simulation/loose_objects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <iostream>
#include <numbers>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/solid_moments.hpp"
#include "common/robot/skin/finger_points.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::simulation {
namespace {

constexpr double kStep_s = 0.001;
constexpr double kTable_m = 0.5;

LooseObject solid(std::uint16_t id, const geometry::TriangleMesh& mesh, double mass_kg,
                  const geometry::Pose& X_WO) {
  const geometry::SolidMoments moments = geometry::solid_moments(mesh);
  return {id, mesh, {mass_kg, moments.centre_m, mass_kg * moments.inertia_m2, X_WO}};
}

LooseObject block(std::uint16_t id, const Eigen::Vector3d& size_m, double mass_kg,
                  const Eigen::Vector3d& at_m, double yaw_rad = 0.0) {
  return solid(id, geometry::make_box(size_m), mass_kg, {geometry::rotation_from_rpy(0, 0, yaw_rad), at_m});
}

const robot::SerialArm& laboratory_arm(double finger_m) {
  const auto load = [](double q_m) {
    return robot::SerialArm::from_urdf(PHANTOM_SOURCE_DIR "/deploy/arms/laboratory_arm.urdf", "tool",
                                       {Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.5}}, {{"finger_left", q_m}})
        .value();
  };
  static const robot::SerialArm open = load(0.05), closed = load(0.0);
  return finger_m > 0.0 ? open : closed;
}

double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// The joints with the tool's point at radius and height, pointing down, with its fingers along the radius'
/// normal.
core::JointArray down_at(double radius_m, double z_m, double waist_rad = 0.0) {
  const double upper_m = 0.36, fore_m = 0.33, dz_m = z_m + 0.19 - 0.78;
  const double away_m = std::hypot(radius_m, dz_m);
  const double elbow = std::numbers::pi - std::acos((upper_m * upper_m + fore_m * fore_m - away_m * away_m) /
                                                    (2 * upper_m * fore_m));
  const double shoulder =
      std::atan2(radius_m, dz_m) - std::atan2(fore_m * std::sin(elbow), upper_m + fore_m * std::cos(elbow));
  return {waist_rad, shoulder, elbow, 0.0, std::numbers::pi - shoulder - elbow, 0.0};
}

/// The laboratory's arm over a table, held by position loops.
class Bench {
 public:
  explicit Bench(std::vector<LooseObject> loose, double pad_friction = 0.6,
                 const core::JointArray& start = down_at(0.45, 0.75))
      : reference(start),
        plant(arm_, parameters(), points(), table_, start, {0, 0, 0.13},
              {.gripper = GripperPlantParameters{.widest_m = 0.1, .finger_mass_kg = 0.3},
               .pad_friction = pad_friction,
               .loose = std::move(loose)}) {}

  void run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds / kStep_s));
    const core::JointArray from = at_;
    for (int i = 0; i < steps; ++i) {
      const double phase = (i + 1.0) / steps;
      const double share = phase * phase * phase * (10 - 15 * phase + 6 * phase * phase);
      for (std::size_t j = 0; j < 6; ++j) {
        at_[j] = from[j] + share * (reference[j] - from[j]);
        drive_Nm[j] = kP * (at_[j] - plant.true_position()[j]) - kD * plant.true_velocity()[j];
      }
      plant.step(drive_Nm, kStep_s);
    }
  }
  void go(const core::JointArray& q, double seconds) {
    reference = q;
    run(seconds);
  }
  geometry::Pose pose(std::size_t i = 0) const { return plant.pose_of_loose(i); }
  geometry::Pose pose_in_hand(std::size_t i = 0) const {
    robot::LinkPoses X_WL;
    arm_.link_poses(plant.true_position(), X_WL);
    return X_WL[6].inverse() * pose(i);
  }

  static constexpr double kP = 8000.0, kD = 150.0;
  core::JointArray reference, drive_Nm{};

 private:
  static SlavePlantParameters parameters() {
    SlavePlantParameters made;
    for (std::size_t j = 0; j < 6; ++j) {
      made.rotor[j] = 0.3;
      made.joints[j] = {.viscous = 1.0, .coulomb = 0.0, .lower = -3.0, .upper = 3.0};
      made.encoder_resolution[j] = 1e-6;
    }
    return made;
  }
  static std::vector<ContactPoint> points() {
    std::vector<ContactPoint> made;
    const auto fingers = robot::finger_points(laboratory_arm(0.05), laboratory_arm(0.0), 0.006).value();
    for (const auto& point : fingers) made.push_back({point.link, point.open_m, point.closing_m});
    return made;
  }
  const robot::SerialArm& arm_ = laboratory_arm(0.05);
  HalfSpace table_{Eigen::Vector3d::UnitZ(), kTable_m};
  core::JointArray at_ = reference;

 public:
  SlavePlant plant;
};

TEST(LooseObjects, ABlockFallsAndLiesWhereItFellWithoutCreeping) {
  Bench bench({block(7, {0.06, 0.05, 0.10}, 0.8, {-0.4, 0.2, kTable_m + 0.15}, 0.3)});
  bench.run(1.0);
  const geometry::Pose lies = bench.pose();
  EXPECT_NEAR(lies.translation_m.z(), kTable_m + 0.05, 1e-4);
  EXPECT_NEAR(lies.rotation(2, 2), 1.0, 1e-6);
  bench.run(3.0);
  EXPECT_LT((bench.pose().translation_m - lies.translation_m).norm(), 2e-5);
  EXPECT_LT((bench.pose().rotation - lies.rotation).norm(), 1e-4);
}

TEST(LooseObjects, ATallBlockTipsBeyondTheAngleOfItsEdgeAndFallsBackBelowIt) {
  const Eigen::Vector3d size_m{0.04, 0.04, 0.16};
  const double edge_rad = std::atan(0.04 / 0.16);
  for (const double share : {0.85, 1.15}) {
    LooseObject tall = block(7, size_m, 0.5, {-0.4, 0.2, 0});
    const double lean_rad = share * edge_rad;
    tall.body.X_WO.rotation = geometry::rotation_from_rpy(0, lean_rad, 0);
    tall.body.X_WO.translation_m.z() = kTable_m + 0.08 * std::cos(lean_rad) + 0.02 * std::sin(lean_rad);
    Bench bench({tall});
    bench.run(3.0);
    const double upright = bench.pose().rotation(2, 2);
    if (share < 1.0) {
      EXPECT_GT(upright, 0.999);
    } else {
      EXPECT_LT(std::abs(upright), 0.01) << "it lies on its side";
      EXPECT_NEAR(bench.pose().translation_m.z(), kTable_m + 0.02, 1e-3);
    }
  }
}

TEST(LooseObjects, ThreeStackedBlocksStandAndBearOneAnother) {
  std::vector<LooseObject> stack;
  for (std::uint16_t i = 0; i < 3; ++i)
    stack.push_back(block(i + 1, {0.06, 0.06, 0.06}, 0.5, {-0.4, 0.2, kTable_m + 0.03 + 0.06 * i}));
  Bench bench(std::move(stack));
  bench.run(3.0);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(bench.pose(i).translation_m.z(), kTable_m + 0.03 + 0.06 * static_cast<double>(i), 3e-4);
    EXPECT_NEAR(bench.pose(i).rotation(2, 2), 1.0, 1e-5);
  }
}

// The grip of the block: its width, the force on it, its weight in the joints, and the way with the hand.
TEST(LooseObjects, ABlockIsGrippedLiftedCarriedAndDropped) {
  constexpr double kMass_kg = 0.8, kForce_N = 25.0;
  const Eigen::Vector3d size_m{0.05, 0.042, 0.10};
  Bench bench({block(7, size_m, kMass_kg, {0.45, 0.0, kTable_m + 0.05})});
  bench.go(down_at(0.45, kTable_m + 0.06), 2.0);
  EXPECT_FALSE(bench.plant.contact().contact);
  bench.plant.grip(0.0, kForce_N);
  bench.run(1.0);
  ASSERT_TRUE(bench.plant.holds(0));
  EXPECT_NEAR(bench.plant.gripper()->width_m(), size_m.y(), 5e-4);
  EXPECT_NEAR(bench.plant.gripper()->drive_force_N(), kForce_N, 1e-6);
  EXPECT_TRUE(bench.plant.contact().contact) << "what it holds stands on the table";
  EXPECT_EQ(bench.plant.contact().object, HalfSpace::kObject);

  core::JointArray empty_Nm{};
  {
    Bench other({});
    other.go(down_at(0.45, 0.75), 3.0);
    empty_Nm = other.drive_Nm;
  }
  bench.go(down_at(0.45, 0.75), 2.0);
  const geometry::Pose held = bench.pose_in_hand();
  bench.run(1.0);
  EXPECT_FALSE(bench.plant.contact().contact) << "what is held is no contact";
  EXPECT_NEAR(bench.pose().translation_m.z(), kTable_m + 0.05 + 0.19, 3e-3);
  // The weight is on shoulder and elbow with its lever, as statics say.
  robot::LinkPoses X_WL;
  laboratory_arm(0.05).link_poses(bench.plant.true_position(), X_WL);
  core::JointArray weight_Nm{};
  laboratory_arm(0.05).add_force(6, bench.pose().translation_m, {0, 0, -kMass_kg * robot::kGravity_m_s2},
                                 X_WL, weight_Nm);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(bench.drive_Nm[j] - empty_Nm[j], -weight_Nm[j], 0.02 + 0.01 * std::abs(weight_Nm[j])) << j;
  EXPECT_GT(std::abs(weight_Nm[1]), 3.0);
  EXPECT_LT((bench.pose_in_hand().translation_m - held.translation_m).norm(), 2e-5) << "no slip at rest";

  bench.go(down_at(0.40, 0.70, 0.8), 1.5);
  EXPECT_TRUE(bench.plant.holds(0));
  EXPECT_LT((bench.pose_in_hand().translation_m - held.translation_m).norm(), 5e-4) << "nor on the way";
  EXPECT_LT((bench.pose_in_hand().rotation - held.rotation).norm(), 0.02);

  bench.plant.grip(0.1, kForce_N);
  bench.run(2.0);
  EXPECT_FALSE(bench.plant.holds(0));
  EXPECT_NEAR(bench.plant.gripper()->width_m(), 0.1, 1e-4);
  EXPECT_LT(bench.pose().translation_m.z(), kTable_m + 0.0501) << "it fell";
  EXPECT_NEAR(std::atan2(bench.pose().translation_m.y(), bench.pose().translation_m.x()), 0.8, 0.2);
}

TEST(LooseObjects, WhatIsTooHeavyForTheFrictionSlipsOut) {
  for (const double friction : {0.1, 0.6}) {
    Bench bench({block(7, {0.05, 0.042, 0.10}, 0.8, {0.45, 0.0, kTable_m + 0.05})}, friction);
    bench.go(down_at(0.45, kTable_m + 0.06), 1.5);
    bench.plant.grip(0.0, 20.0);
    bench.run(0.8);
    bench.go(down_at(0.45, 0.75), 1.5);
    // Two faces bear 2·µ·F at most: 4 N or 24 N of 7.8 N.
    EXPECT_EQ(bench.plant.holds(0), friction > 0.2) << friction;
  }
}

TEST(LooseObjects, AnArmThatPushesOneIsInContactWithItAndMovesIt) {
  Bench bench({block(7, {0.05, 0.05, 0.10}, 0.4, {0.45, 0.13, kTable_m + 0.05})});
  bench.plant.grip(0.0, 20.0);
  bench.go(down_at(0.45, kTable_m + 0.04), 2.0);
  bool touched = false;
  bench.reference = down_at(0.45, kTable_m + 0.04, 0.35);
  for (int i = 0; i < 40; ++i) {
    bench.run(0.05);
    const ContactReport& now = bench.plant.contact();
    touched = touched || (now.contact && now.object == 7 && std::abs(now.joint_torque_Nm[0]) > 0.1);
  }
  EXPECT_TRUE(touched);
  EXPECT_GT(bench.pose().translation_m.y(), 0.15);
  EXPECT_FALSE(bench.plant.holds(0));
}

TEST(LooseObjects, AFixedPayloadLoadsTheArmWithItsWeight) {
  Bench bench({});
  bench.run(1.0);
  const core::JointArray empty_Nm = bench.drive_Nm;
  robot::Payload payload;
  payload.on_link[6] = {1.5, {0.0, 0.01, 0.1}, {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01}};
  bench.plant.carry(payload);
  bench.run(2.0);
  robot::LinkPoses X_WL;
  laboratory_arm(0.05).link_poses(bench.plant.true_position(), X_WL);
  core::JointArray weight_Nm{};
  laboratory_arm(0.05).add_force(6, X_WL[6] * payload.on_link[6].centre(),
                                 {0, 0, -1.5 * robot::kGravity_m_s2}, X_WL, weight_Nm);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(bench.drive_Nm[j] - empty_Nm[j], -weight_Nm[j], 1e-3 + 0.01 * std::abs(weight_Nm[j])) << j;
}

/// A bare loop of about 100 µs on an idle core, by which a slow or loaded one is known.
double bare_loop() {
  double sum = 0.0;
  for (int i = 1; i <= 20'000; ++i) sum += std::sqrt(sum + i);
  return sum;
}

/// What a step may take at most, as a multiple of a bare loop; 1.6 were measured.
constexpr double kMaxBareLoops = 5.0;

TEST(LooseObjects, AStepAllocatesNothingAndIsFarShorterThanItsMillisecond) {
  std::vector<LooseObject> loose;
  for (std::uint16_t i = 0; i < 3; ++i)
    loose.push_back(solid(i + 1, geometry::make_cylinder(0.03, 0.06, 400), 0.4,
                          {Eigen::Matrix3d::Identity(), {-0.4, 0.2 * i, kTable_m + 0.03}}));
  loose.push_back(block(7, {0.05, 0.042, 0.10}, 0.8, {0.45, 0.0, kTable_m + 0.05}));
  Bench bench(std::move(loose));
  bench.go(down_at(0.45, kTable_m + 0.06), 1.0);
  bench.plant.grip(0.0, 20.0);
  bench.run(1.0);
  ASSERT_TRUE(bench.plant.holds(3));
  double worst_us = 0.0, sum_us = 0.0, bare_us = 0.0, bare_sum = 0.0;
  {
    const test::HeapGuard guard;
    for (int i = 0; i < 1000; ++i) {
      const double begun_us = thread_us();
      bench.run(kStep_s);
      const double took_us = thread_us() - begun_us;
      worst_us = std::max(worst_us, took_us);
      sum_us += took_us;
      const double bare_begun_us = thread_us();
      bare_sum += bare_loop();
      bare_us += thread_us() - bare_begun_us;
    }
  }
  std::cout << "a step of 1 ms with four loose objects, one of them gripped and standing: " << sum_us / 1000
            << " us of processor time, at worst " << worst_us << " us; a bare loop " << bare_us / 1000
            << " us\n";
  RecordProperty("step_us", static_cast<int>(sum_us / 1000));
  ASSERT_GT(bare_sum, 0.0);
  EXPECT_LT(sum_us / bare_us, kMaxBareLoops);
}

}  // namespace
}  // namespace phantom::simulation
