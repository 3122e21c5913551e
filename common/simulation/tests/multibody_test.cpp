// The equations of motion against Orocos KDL, conserved quantities and textbook cases.
#include "common/simulation/multibody.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "common/robot/tests/kdl_arm.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::simulation {
namespace {

using core::JointArray;

constexpr double kSub_s = 0.00025;
constexpr double kGravity = robot::kGravity_m_s2;

const robot::SerialArm& shipped_arm() {
  static const robot::SerialArm made =
      robot::SerialArm::from_urdf(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/arm/suspended_arm.urdf", "tool",
                                  {geometry::rotation_from_rpy(0.1, -0.2, 0.3), {0.1, 0.2, 1.5}})
          .value();
  return made;
}

JointArray rotors() {
  JointArray rotor{};
  rotor.fill(0.3);
  rotor[0] = 5.0;
  return rotor;
}

struct Motion {
  JointArray q{}, v{};
};

Motion motion_of(const Multibody& world, std::size_t count) {
  Motion motion;
  for (std::size_t j = 0; j < count; ++j) motion.q[j] = world.q(j), motion.v[j] = world.v(j);
  return motion;
}

/// A world without joints' friction and limits, and an arm that is far away from loose bodies.
Multibody world_of(const JointArray& q, const std::vector<LooseBody>& loose = {}) {
  return Multibody(shipped_arm(), {}, rotors(), q, {}, loose, kSub_s);
}

// Of every step: the velocity that KDL's mass matrix and Coriolis torques give it.
TEST(Multibody, AcceleratesAsKdlWhereverItIsAndHoweverFast) {
  const robot::SerialArm& arm = shipped_arm();
  robot::KdlDynamics kdl(robot::kdl_chain(arm), {}, rotors());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> torque(-60, 60);
  for (int trial = 0; trial < 20; ++trial) {
    Multibody world = world_of(robot::test_arms::random_joints(arm, random));
    JointArray drive{};
    double fastest = 0.0;
    for (int i = 0; i < 400; ++i) {
      if (i % 100 == 0)
        for (std::size_t j = 0; j < arm.joint_count(); ++j) drive[j] = torque(random);
      const Motion before = motion_of(world, arm.joint_count());
      Eigen::VectorXd push = -kdl.coriolis(before.q, before.v);
      for (std::size_t j = 0; j < arm.joint_count(); ++j) push[static_cast<Eigen::Index>(j)] += drive[j];
      const Eigen::VectorXd expected = kdl.mass(before.q).ldlt().solve(push);
      world.advance(drive, {});
      for (std::size_t j = 0; j < arm.joint_count(); ++j) {
        const double acceleration = (world.v(j) - before.v[j]) / kSub_s;
        ASSERT_NEAR(acceleration, expected[static_cast<Eigen::Index>(j)],
                    1e-6 * (1.0 + std::abs(acceleration)))
            << "joint " << j << ", trial " << trial;
        fastest = std::max(fastest, std::abs(world.v(j)));
      }
    }
    EXPECT_GT(fastest, 1.0) << "centrifugal forces must count";
  }
}

TEST(Multibody, APayloadIsPartOfTheLastLink) {
  const robot::LoadBody payload{5.0, {0.02, -0.01, -0.2}, {0.03, 0, 0, 0, 0.02, 0, 0, 0, 0.04}};
  robot::Payload on_last;
  on_last.on_link[7] = payload;
  KDL::Chain chain = robot::kdl_chain(shipped_arm());
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), KDL::Frame(),
                                robot::kdl_body(payload.mass_kg, payload.centre(), payload.inertia())));
  robot::KdlDynamics kdl(chain, {}, rotors());
  const JointArray q{0.1, 0.3, 0.8, 0.9, 0.2, 0.5, 0.4};
  Multibody world(shipped_arm(), {}, rotors(), q, {}, {}, kSub_s);
  {
    const test::HeapGuard guard;
    world.carry(shipped_arm(), on_last);
  }
  const JointArray drive{20, -10, 30, 5, 2, -8, 1};
  world.advance(drive, {});
  const Eigen::VectorXd expected = kdl.mass(q).topLeftCorner(7, 7).ldlt().solve(robot::vector_of(drive, 7));
  for (std::size_t j = 0; j < 7; ++j)
    EXPECT_NEAR(world.v(j) / kSub_s, expected[static_cast<Eigen::Index>(j)], 1e-6) << j;
}

TEST(Multibody, AnUndrivenArmKeepsItsEnergy) {
  Multibody world = world_of({0, 0.3, 0.8, 0.9, 0.2, 0.5, 0});
  JointArray push{};
  push[1] = 60.0, push[2] = -40.0, push[3] = 30.0;
  for (int i = 0; i < 800; ++i) world.advance(push, {});
  const double before_J = world.kinetic_J();
  EXPECT_GT(before_J, 5.0);
  double turned = world.q(1);
  for (int i = 0; i < 8000; ++i) {
    world.advance({}, {});
    ASSERT_NEAR(world.kinetic_J(), before_J, 0.01 * before_J) << "step " << i;
  }
  EXPECT_GT(std::abs(world.q(1) - turned), 2.0);
}

TEST(Multibody, AJointWithinItsFrictionStaysWhereItIs) {
  ArmMechanics joints{};
  JointArray push{};
  for (std::size_t j = 0; j < 7; ++j) joints[j].coulomb = 2.0, push[j] = j % 2 == 0 ? 1.99 : -1.99;
  Multibody world(shipped_arm(), joints, rotors(), {0, 0.3, 0.8, 0.9, 0.2, 0.5, 0}, {}, {}, kSub_s);
  const Motion before = motion_of(world, 7);
  for (int i = 0; i < 8000; ++i) world.advance(push, {});
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(world.q(j), before.q[j], 1e-7) << j;
  push[3] = -2.2;
  for (int i = 0; i < 800; ++i) world.advance(push, {});
  EXPECT_LT(world.q(3), before.q[3] - 1e-4) << "and moves beyond it";
}

TEST(Multibody, EndStopsHold) {
  ArmMechanics joints{};
  for (std::size_t j = 0; j < 7; ++j) joints[j].lower = -0.1, joints[j].upper = 0.1;
  Multibody world(shipped_arm(), joints, rotors(), {}, {}, {}, kSub_s);
  JointArray push{};
  push[3] = 50.0;
  for (int i = 0; i < 8000; ++i) world.advance(push, {});
  EXPECT_NEAR(world.q(3), 0.1, 1e-4);
  EXPECT_NEAR(world.v(3), 0.0, 1e-4);
}

/// A box on a plane that slopes by `angle_rad` towards +x, with its four lower corners as contacts.
class Slope {
 public:
  Slope(const Eigen::Vector3d& size_m, double friction, double mass_kg = 1.0)
      : half_m_(0.5 * size_m),
        friction_(friction),
        world_(Multibody(shipped_arm(), {}, rotors(), {}, {}, std::vector{box(mass_kg)}, kSub_s)) {}

  /// Lets time pass while the plane is tilted evenly.
  void run(double seconds, double to_rad) {
    const int steps = static_cast<int>(seconds / kSub_s);
    const double from_rad = angle_rad_;
    for (int i = 0; i < steps; ++i) {
      angle_rad_ = from_rad + (to_rad - from_rad) * (i + 1) / steps;
      X_WP_.rotation = geometry::rotation_about(Eigen::Vector3d::UnitY(), angle_rad_);
      std::vector<Contact> contacts;
      const geometry::Pose X = pose_P();
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d p =
            X * Eigen::Vector3d((corner & 1 ? 1 : -1) * half_m_.x(), (corner & 2 ? 1 : -1) * half_m_.y(),
                                (corner & 4 ? 1 : -1) * half_m_.z());
        if (p.z() >= 0.0) continue;
        Contact contact;
        contact.a = world_.first_loose();
        contact.point_W_m = X_WP_ * p;
        contact.normal_W = X_WP_.rotation.col(2);
        contact.depth_m = -p.z();
        contact.friction = friction_;
        contacts.push_back(contact);
      }
      world_.advance({}, contacts);
      force_N = Eigen::Vector3d::Zero();
      for (const Contact& contact : contacts) force_N += contact.force_W_N;
    }
  }
  geometry::Pose pose_P() const { return X_WP_.inverse() * world_.pose(world_.first_loose()); }
  double along_m() const { return pose_P().translation_m.x(); }
  /// Along the plane in the step that follows.
  double speed() {
    const double before_m = along_m();
    run(kSub_s, angle_rad_);
    return (along_m() - before_m) / kSub_s;
  }
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();

 private:
  LooseBody box(double mass_kg) const {
    LooseBody body;
    body.mass_kg = mass_kg;
    const Eigen::Vector3d square = half_m_.cwiseProduct(half_m_);
    body.inertia_kg_m2 = (mass_kg / 3.0 * (square.sum() - square.array())).matrix().asDiagonal();
    body.X_WO = {X_WP_.rotation,
                 X_WP_ * Eigen::Vector3d(0, 0, half_m_.z() - mass_kg * kGravity / 4 / 30'000)};
    return body;
  }
  Eigen::Vector3d half_m_;
  geometry::Pose X_WP_{Eigen::Matrix3d::Identity(), {30, 0, 0}};
  double angle_rad_ = 0.0;
  double friction_;
  Multibody world_;
};

TEST(Multibody, ABlockSticksBelowTheAngleOfFrictionAndSlidesAboveItAsTheTextbookSays) {
  for (const double friction : {0.2, 0.5, 0.8}) {
    Slope below({0.1, 0.1, 0.1}, friction);
    const double low = std::atan(0.95 * friction), high = std::atan(1.1 * friction);
    below.run(1.0, low);
    below.run(0.5, low);
    const double start_m = below.along_m();
    below.run(2.0, low);
    EXPECT_NEAR(below.along_m(), start_m, 2e-6) << "creeps by less than 1 µm/s";
    Slope above({0.1, 0.1, 0.1}, friction);
    above.run(1.0, high);
    above.run(0.5, high);
    const double v0 = above.speed();
    above.run(1.0, high);
    const double expected = kGravity * (std::sin(high) - friction * std::cos(high));
    EXPECT_NEAR(above.speed() - v0, expected, 0.01 * expected) << friction;
    EXPECT_NEAR(above.pose_P().translation_m.z(), 0.05, 1e-4) << "slides on the plane, not above it";
  }
}

TEST(Multibody, ATallBlockTipsAtTheAngleOfItsEdge) {
  const auto leans = [](double at_rad) {
    Slope slope({0.05, 0.05, 0.2}, 1.0);
    slope.run(2.0, at_rad);
    slope.run(2.0, at_rad);
    return slope.pose_P().rotation(2, 2);
  };
  const double edge_rad = std::atan(0.05 / 0.2);
  EXPECT_GT(leans(0.92 * edge_rad), 0.999);
  EXPECT_LT(leans(1.02 * edge_rad), 0.1) << "lies on its side";
}

TEST(Multibody, AtRestItsWeightIsBorneAndTheSpringPressedAsStated) {
  Slope level({0.1, 0.1, 0.1}, 0.5, 2.0);
  level.run(3.0, 0.0);
  EXPECT_NEAR(level.force_N.z(), 2.0 * kGravity, 1e-3);
  EXPECT_NEAR(level.pose_P().translation_m.z(), 0.05 - 2.0 * kGravity / 4 / 30'000, 1e-6);
  EXPECT_NEAR(level.speed(), 0.0, 1e-6);
}

TEST(Multibody, FallsFreely) {
  LooseBody body;
  body.X_WO.translation_m = {0, 0, 5};
  Multibody world = world_of({}, {body});
  for (int i = 0; i < 2000; ++i) world.advance({}, {});
  EXPECT_NEAR(world.pose(world.first_loose()).translation_m.z(), 5.0 - 0.5 * kGravity * 0.25,
              0.5 * kGravity * 0.5 * kSub_s + 1e-9)
      << "up to half a step of its speed";
}

TEST(Multibody, PosesAreThoseOfTheArm) {
  const robot::SerialArm& arm = shipped_arm();
  std::mt19937 random(9);
  for (int trial = 0; trial < 20; ++trial) {
    const JointArray q = robot::test_arms::random_joints(arm, random);
    Multibody world = world_of(q);
    robot::LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    for (std::size_t link = 1; link <= arm.joint_count(); ++link) {
      EXPECT_LT((world.pose(link).translation_m - X_WL[link].translation_m).norm(), 1e-9);
      EXPECT_LT((world.pose(link).rotation - X_WL[link].rotation).norm(), 1e-9);
    }
  }
}

TEST(Multibody, NumbersThatAreNoneStopItAndAllocatesNothing) {
  LooseBody body;
  body.X_WO.translation_m = {30, 0, 0.5};
  Multibody world = world_of({0, 0.3, 0.8}, {body});
  std::vector<Contact> contacts(Multibody::kMaxContacts + 10);
  for (Contact& contact : contacts)
    contact.a = world.first_loose(), contact.point_W_m = {30, 0, 0.4}, contact.depth_m = 1e-4;
  {
    const test::HeapGuard guard;
    for (int i = 0; i < 20; ++i) world.advance({}, contacts);
    JointArray bad{};
    bad[2] = std::nan("");
    for (int i = 0; i < 3; ++i) world.advance(bad, {});
    for (int i = 0; i < 20; ++i) world.advance({}, {});
  }
  EXPECT_EQ(contacts.back().force_W_N, Eigen::Vector3d::Zero()) << "beyond the greatest number";
  for (std::size_t j = 0; j < 7; ++j) EXPECT_TRUE(std::isfinite(world.q(j))) << j;
  EXPECT_NEAR(world.q(2), 0.8, 0.01);
}

}  // namespace
}  // namespace phantom::simulation
