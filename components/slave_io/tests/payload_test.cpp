// What the arm carries, in the weight that is fed forward and in the force that is felt.
#include "components/slave_io/payload.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/kinematics/arm_dynamics.hpp"
#include "common/teleop/coupling/counterbalance.hpp"
#include "common/teleop/guards/momentum_observer.hpp"
#include "components/slave_io/tests/arm_bench.hpp"
#include "components/slave_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using testing::HasSubstr;

const robot::SerialArm& arm() { return shipped_arm().arm; }
std::size_t last_link() { return arm().joint_count(); }

messages::CarriedObject pump(double mass_kg = 4.0) {
  messages::CarriedObject object{
      .id = 3, .arm = "left", .frame = arm().links().back().name, .mass_kg = mass_kg};
  object.X_FO = {geometry::rotation_from_rpy(0.2, 0.3, -0.4), {0.0, 0.02, 0.1}};
  object.centre_of_mass_m = {0.01, 0.0, 0.05};
  object.moments_kg_m2 = {0.02, 0.03, 0.04};
  return object;
}

// Tries slave_io: weighs more than `max_payload_kg`
// Tries slave_io: is on a link that the arm does not have
// Tries slave_io: has an inertia that no body has
TEST(Payload, IsWhatThisArmCarriesAndMayCarry) {
  const PayloadRule rule{&arm(), "left", 10.0};
  messages::CarriedObject other = pump(3.0), light = pump(0.0);
  other.arm = "right";
  const auto payload = payload_of({pump(), other, light}, rule);
  ASSERT_TRUE(payload) << payload.status().message();
  EXPECT_EQ(payload->mass_kg(), 4.0);
  const robot::LoadBody& body = payload->on_link[last_link()];
  const auto [link, X_LF] = *arm().find_frame(arm().links().back().name);
  EXPECT_TRUE(body.centre().isApprox(X_LF * (pump().X_FO * pump().centre_of_mass_m), 1e-12));
  EXPECT_NEAR(body.inertia().trace(), 0.09, 1e-12);
  PayloadRule knows = rule;
  knows.weighed = {pump().id};
  EXPECT_EQ(payload_of({pump()}, knows)->mass_kg(), 0.0) << "what the simulated fingers hold weighs already";
  const auto refused = [&](const messages::CarriedObject& object) {
    const auto answer = payload_of({object}, rule);
    return answer ? std::string("counted") : answer.status().message();
  };
  EXPECT_THAT(refused(pump(10.5)), HasSubstr("it weighs 10.5 kg; allowed: 10 kg (max_payload_kg)"));
  messages::CarriedObject odd = pump();
  odd.frame = "claw";
  EXPECT_THAT(refused(odd), HasSubstr("'claw', which is no moving link"));
  odd = pump();
  odd.products_kg_m2 = {1.0, 0.0, 0.0};
  EXPECT_THAT(refused(odd), HasSubstr("inertia that no body has"));
}

TEST(Payload, DisplacesTheVolumeThatTheCellKnowsOfIt) {
  const PayloadRule rule{&arm(), "left", 10.0, {}, {{pump().id, 0.0015}}};
  messages::CarriedObject other = pump();
  other.id = 9;
  const auto payload = payload_of({pump(), other}, rule);
  ASSERT_TRUE(payload);
  EXPECT_EQ(payload->mass_kg(), 8.0);
  EXPECT_EQ(payload->displaced_m3(), 0.0015) << "of object 9 nothing is known";
  const auto [link, X_LF] = *arm().find_frame(arm().links().back().name);
  EXPECT_TRUE(Eigen::Vector3d::Map(payload->on_link[last_link()].displaced_at_m.data())
                  .isApprox(X_LF * (pump().X_FO * pump().centre_of_mass_m), 1e-12));
}

TEST(Payload, ItsWeightComesAndGoesWithoutAJump) {
  teleop::PayloadWeight weight;
  core::JointArray zero{}, heavy{}, light{};
  heavy.fill(40.0), light.fill(-10.0);
  double before = 0.0;
  const auto run = [&](const core::JointArray& target, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const test::HeapGuard guard;
      const double now = weight.step(target, i == 0, 0.001)[0];
      EXPECT_LE(std::abs(now - before), 0.001 * 51.0 + 1e-12);
      before = now;
    }
  };
  run(zero, 10);
  run(heavy, 1001);
  EXPECT_DOUBLE_EQ(before, 40.0);
  run(zero, 300);  // let go, and taken again at once
  run(light, 1001);
  EXPECT_DOUBLE_EQ(before, -10.0);
}

/// An arm that swings with what it carries: the torque of its drives follows from the equation of motion of
/// the whole, by differences of the momentum.
TEST(Payload, IsNoForceFromOutsideWhileItIsCarried) {
  const PayloadRule rule{&arm(), "left", 10.0};
  const robot::Payload carried = *payload_of({pump()}, rule);
  teleop::MomentumObserverParameters parameters{.lag_s = 0.01, .weight = true};
  parameters.threshold_Nm.fill(0.05), parameters.slow_rad_s.fill(0.01), parameters.inertia_kg_m2.fill(0.1);
  teleop::MomentumObserver aware(arm(), parameters), unaware(arm(), parameters);
  constexpr double kTick_s = 1e-4;
  double worst_Nm = 0.0, unaware_Nm = 0.0, jump_Nm = 0.0;
  core::JointArray before_r{};
  robot::ArmMomentum before{};
  for (int i = 0; i < 20'000; ++i) {
    const double t = i * kTick_s;
    const bool loaded = i >= 10'000;
    const robot::Payload now = loaded ? carried : robot::Payload{};
    core::JointArray q = shipped_arm().home, v{};
    for (std::size_t j = 0; j < arm().joint_count(); ++j) {
      q[j] += 0.05 * std::sin(3.0 * t + static_cast<double>(j));
      v[j] = 0.15 * std::cos(3.0 * t + static_cast<double>(j));
    }
    robot::LinkPoses X_WL;
    arm().link_poses(q, X_WL);
    const auto momentum = robot::momentum_of(arm(), parameters.inertia_kg_m2, X_WL, v, now);
    core::JointArray torque = arm().gravity_torque(X_WL);
    robot::add_weight(arm(), now, X_WL, torque);
    // τ = dp/dt + g − Cᵀv; where the body comes, its momentum is no torque's.
    for (std::size_t j = 0; j < arm().joint_count(); ++j) {
      const double slope =
          i == 0 || i == 10'000 ? 0.0 : (momentum.momentum[j] - before.momentum[j]) / kTick_s;
      torque[j] += slope - momentum.drift[j];
    }
    before = momentum;
    aware.step(X_WL, {true, v, torque}, kTick_s, now);
    unaware.step(X_WL, {true, v, torque}, kTick_s);
    for (std::size_t j = 0; j < arm().joint_count(); ++j) {
      worst_Nm = std::max(worst_Nm, std::abs(aware.residual_Nm()[j]));
      jump_Nm = std::max(jump_Nm, std::abs(aware.residual_Nm()[j] - before_r[j]));
      if (loaded) unaware_Nm = std::max(unaware_Nm, std::abs(unaware.residual_Nm()[j]));
    }
    before_r = aware.residual_Nm();
  }
  EXPECT_LT(worst_Nm, 0.02);
  EXPECT_LT(jump_Nm, 0.01);
  EXPECT_GT(unaware_Nm, 1.0) << "without knowing of it, the observer takes it for a contact";
}

// Drives that bear arm and pump: what the pump weighs stands in F_as until it is known that it is carried.
TEST(Payload, ItsWeightLeavesTheFedBackTorqueOfACounterbalancedArmWhichStaysWhereItIs) {
  Config config = can_config();
  config.plant.balanced = false;
  config.gravity_feed_forward = true;
  const robot::Payload carried = *payload_of({pump()}, {&arm(), "left", 10.0});
  robot::LinkPoses X_WL;
  arm().link_poses(shipped_arm().home, X_WL);
  core::JointArray whole_Nm = arm().gravity_torque(X_WL), pump_Nm{}, coulomb_Nm{};
  robot::add_weight(arm(), carried, X_WL, pump_Nm);
  for (std::size_t j = 0; j < arm().joint_count(); ++j) whole_Nm[j] += pump_Nm[j];
  ArmBench bench(config, shipped_arm().home, [&](std::size_t j, simulated_drive::DriveOptions& drive) {
    drive.motor.load_Nm = -whole_Nm[j];
    coulomb_Nm[j] = drive.motor.joint.coulomb;
  });
  ASSERT_TRUE(bench.reaches(teleop::LinkState::kCoupled)) << bench.arm->health().message;
  bench.run(2.0);
  const auto bound_Nm = [&](std::size_t j) { return coulomb_Nm[j] + 0.01 * arm().joints()[j].max_effort; };
  double greatest_Nm = 0.0;
  for (std::size_t j = 0; j < arm().joint_count(); ++j) {
    EXPECT_NEAR(bench.last.loop_torque_Nm[j], pump_Nm[j], bound_Nm(j)) << "not known yet, joint " << j;
    greatest_Nm = std::max(greatest_Nm, std::abs(pump_Nm[j]) - 2.0 * bound_Nm(j));
  }
  EXPECT_GT(greatest_Nm, 0.0) << "no joint bears the pump: this shows nothing";
  bench.inbox.payload.write(carried);
  bench.fastest = 0.0;
  bench.run(2.0);
  ASSERT_EQ(bench.state(), teleop::LinkState::kCoupled);
  EXPECT_LT(bench.fastest, 0.05) << "of a joint's greatest speed";
  for (std::size_t j = 0; j < arm().joint_count(); ++j) {
    EXPECT_LE(std::abs(bench.last.loop_torque_Nm[j]), bound_Nm(j)) << "carried, joint " << j;
    EXPECT_NEAR(bench.joint(j), shipped_arm().home[j], 0.01) << j;
  }
}

}  // namespace
}  // namespace phantom::slave_io
