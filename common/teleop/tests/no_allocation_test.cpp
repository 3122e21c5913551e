// Real-time promise: no step of this library touches the heap.
#include <gtest/gtest.h>

#include "common/robot/tests/test_arms.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/simulation/reach_script.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/rendering/feedback_rendering.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

using simulation::ContactPoint;
using simulation::HalfSpace;
using simulation::MasterPlant;
using simulation::MasterPlantParameters;
using simulation::OperatorModel;
using simulation::OperatorParameters;
using simulation::Reach;
using simulation::ReachScript;
using simulation::ReachScriptParameters;
using simulation::SlavePlant;
using simulation::SlavePlantParameters;

TEST(Teleop, StepsDoNotAllocate) {
  const auto arm = robot::test_arms::suspended();
  const std::size_t count = arm.joint_count();
  const HalfSpace floor(Eigen::Vector3d::UnitZ(), 0.4);
  SlavePlantParameters sp;
  sp.balanced = false;
  MasterPlantParameters mp{
      .joint_count = count, .joints = {}, .torque_limit_Nm = {}, .encoder_resolution = {}};
  OperatorParameters op{.joint_count = count};
  PerceptParameters pp{.joint_count = count, .torque_cap_Nm = {}, .damping_limit_Nms_per_rad = {}};
  for (std::size_t j = 0; j < count; ++j) {
    sp.rotor[j] = 1.0;
    sp.encoder_resolution[j] = mp.encoder_resolution[j] = 1e-5;
    mp.torque_limit_Nm[j] = 5, op.stiffness[j] = 50, op.damping[j] = 2, op.max_force[j] = 4;
    pp.torque_cap_Nm[j] = 2, pp.damping_limit_Nms_per_rad[j] = 4;
  }
  std::vector<ContactPoint> points;
  for (int i = 0; i < 300; ++i)
    points.push_back({1 + static_cast<std::size_t>(i) % count, {0, 0, -0.001 * i}});
  SlavePlant slave(arm, sp, points, floor, {}, {0, 0, 0});
  MasterPlant master(mp, {});
  OperatorModel hand(op, {});
  Reach there;
  there.target.fill(0.1);
  ReachScriptParameters rp;
  rp.joint_count = count;
  rp.reaches = {there};
  rp.duration_scatter = 0.1;
  ReachScript script(rp, hand);
  PerceptRenderer percept(pp);
  FeedbackParameters fp{.joint_count = count, .limits = {}};
  const double inverse_a[] = {0, 0.1, 0.1, 1, 1};
  for (std::size_t law = 0; law < kBilateralLaws; ++law) fp.inverse_a[law] = everywhere(inverse_a[law]);
  fp.torque_cap_Nm.fill(4);
  fp.exchange.k_p.fill(20);
  fp.passivity.joint_count = count;
  fp.passivity.damping_limit.fill(2);
  fp.limits = FeedbackLimits(std::vector<FeedbackLoop>(
      count, {.master_inertia = 0.05, .slave_inertia = 1, .slave_k_p = 100, .slave_k_v = 10}));
  FeedbackRenderer feedback(fp);
  TorqueSlew slew({.joint_count = count,
                   .percept_cap_Nm = everywhere(2),
                   .feedback_cap_Nm = everywhere(4),
                   .limit_Nm = everywhere(5),
                   .rate_Nm_per_s = everywhere(300)});
  LinkMonitor link{LinkTiming{}, StopLatch(1, {})};
  std::array<JointServoGains, core::kMaxJoints> gains{};
  gains.fill({100, 10, 50});
  const JointServo servo(count, gains);
  DragCoefficients drag;
  drag.valid = true;
  drag.plus.fill(0.2);
  drag.minus.fill(0.1);

  bool touched = false;
  for (int i = 0; i < 20000; ++i) {
    const test::HeapGuard guard;
    link.step({.partner_age_s = 0.001, .partner = LinkState::kCoupled, .poses_agree = true}, 0.001);
    script.step(master.true_position(), true, slave.contact().contact, 0.001);
    const auto out = percept.step(drag, true, script.percept_on(), everywhere(5), master.velocity(), 0.001);
    const auto torque = servo.step(master.position(), master.velocity(), slave.position(), slave.velocity(),
                                   slave.gravity_Nm());
    const auto felt = feedback.step({.law = static_cast<BilateralLaw>(i / 2000 % 5),
                                     .coupled = true,
                                     .contact = slave.contact().contact,
                                     .force_measured = true,
                                     .round_trip_s = 0.003 + 1e-5 * (i % 100),
                                     .master = {master.position(), master.velocity()},
                                     .slave = {slave.position(), slave.velocity()},
                                     .effort = {torque.loop_Nm, slave.contact().joint_torque_Nm}},
                                    0.001);
    master.step(hand.step(master.true_position(), master.true_velocity(), true, 0.001),
                slew.step(out.torque_Nm, felt.torque_Nm, master.velocity(), 0.001).motor_Nm, 0.001);
    feedback.note_rendered(felt.torque_Nm);
    slave.step(torque.drive_Nm, 0.001);
    touched = touched || slave.contact().contact;
  }
  EXPECT_TRUE(touched);  // or the costly branch was never taken
}

}  // namespace
}  // namespace phantom::teleop
