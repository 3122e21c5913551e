// The whole chain in one process, without network: operator, master, slave, contact and a drag that grows
// towards the wall.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "common/robot/tests/test_arms.hpp"
#include "common/simulation/master_plant.hpp"
#include "common/simulation/operator_model.hpp"
#include "common/simulation/slave_plant.hpp"
#include "common/simulation/tests/half_space.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/guards/stability_guard.hpp"
#include "common/teleop/rendering/feedback_rendering.hpp"
#include "common/teleop/rendering/percept_rendering.hpp"
#include "common/teleop/rendering/torque_slew.hpp"
#include "common/teleop/tests/period.hpp"

namespace phantom::teleop {
namespace {

using simulation::ContactWorld;
using simulation::HalfSpace;
using simulation::MasterPlant;
using simulation::MasterPlantParameters;
using simulation::OperatorModel;
using simulation::OperatorParameters;
using simulation::SlavePlant;
using simulation::SlavePlantParameters;

constexpr std::size_t kLoopJoints = 2;

// Six layers of 20 mm around the wall, μ as in the thesis's fig. 4.33, felt by a tip of 0.02 m² at its lever.
DragCoefficients drag_at(const robot::SerialArm& arm, const core::JointArray& q, const ContactWorld& world) {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  const Eigen::Vector3d tip_W_m = X_WL[2] * Eigen::Vector3d(0.3, 0, 0);
  const double clearance_m = world.distance_m(tip_W_m);
  const double mu[] = {32, 20, 13, 11, 10, 9};
  DragCoefficients drag;
  drag.valid = true;
  if (clearance_m >= 0.12) return drag;
  const double mu_here = clearance_m < 0 ? 100 : mu[std::min(5, static_cast<int>(clearance_m / 0.02))];
  for (std::size_t j = 0; j < kLoopJoints; ++j) {
    const double lever_m = (tip_W_m - arm.axis_point_W(j, X_WL)).norm();
    drag.plus[j] = drag.minus[j] = mu_here * 0.02 * lever_m * lever_m;
  }
  return drag;
}

struct Outcome {
  double contact_speed_m_s = -1.0, contact_s = -1.0, peak_percept_Nm = 0.0, far_percept_Nm = 0.0,
         greatest_force_N = 0.0;
  double percept_energy_J = 0.0, feedback_at_contact_Nm = 0.0, greatest_power_W = -1e9;
  double last_swing_Nm = 0.0;  // of the feedback, over the last second
};

MasterPlantParameters master_parameters() {
  MasterPlantParameters p{
      .joint_count = kLoopJoints, .joints = {}, .torque_limit_Nm = {}, .encoder_resolution = {}};
  for (std::size_t j = 0; j < kLoopJoints; ++j) {
    p.joints[j] = {.inertia = 0.02, .viscous = 0.02, .coulomb = 0.02, .lower = -3, .upper = 3};
    p.torque_limit_Nm[j] = 6.0;
    p.encoder_resolution[j] = 2e-5;
  }
  return p;
}

OperatorParameters hand_parameters() {
  OperatorParameters p{.joint_count = kLoopJoints};
  for (std::size_t j = 0; j < kLoopJoints; ++j) p.stiffness[j] = 50, p.damping[j] = 2.5, p.max_force[j] = 4;
  return p;
}

// As test_arms::planar(), but with links so light that the drives' inertia is nearly all.
robot::SerialArm light_planar() {
  std::vector<robot::DhRow> rows(2);
  for (robot::DhRow& row : rows) {
    row.a_m = &row == &rows[0] ? 0.4 : 0.3;
    row.link = &row == &rows[0] ? "upper" : "lower";
    row.lower = -3.0, row.upper = 3.0, row.max_speed = 2.0, row.max_effort = 50.0;
    row.mass_kg = 0.1;
    row.centre_of_mass_m = {-0.5 * row.a_m, 0.0, 0.0};
  }
  return robot::SerialArm::from_dh(rows, robot::DhConvention::kClassic, {}).value();
}

Outcome reach_the_wall(bool percept_on, BilateralLaw law, int network_delay_ticks,
                       double force_share = 0.05) {
  const auto arm = light_planar();
  const HalfSpace wall(-Eigen::Vector3d::UnitY(), -0.30);
  SlavePlantParameters sp;
  std::array<JointServoGains, core::kMaxJoints> gains{};
  for (std::size_t j = 0; j < kLoopJoints; ++j) {
    sp.joints[j] = {.viscous = 1.0, .coulomb = 0.5, .lower = -3, .upper = 3};
    sp.encoder_resolution[j] = 1e-5;
    sp.rotor[j] = 0.58;
    gains[j] = gains_for(0.6, 8, 1.0, 80);
  }
  SlavePlant slave(arm, sp, {{2, {0.3, 0, 0}}}, wall, {}, {0.3, 0, 0});
  const JointServo servo(kLoopJoints, gains);
  MasterPlant master(master_parameters(), {});
  OperatorModel hand(hand_parameters(), {});
  PerceptParameters pp{.joint_count = kLoopJoints, .torque_cap_Nm = {}, .damping_limit_Nms_per_rad = {}};
  DeviceDamping device{
      .joint_count = kLoopJoints, .inertia = {}, .damping_cap = {}, .period_s = kDt, .delay_samples = 3};
  for (std::size_t j = 0; j < kLoopJoints; ++j)
    pp.torque_cap_Nm[j] = 2.2, device.inertia[j] = 0.02, device.damping_cap[j] = 100;
  pp.damping_limit_Nms_per_rad = usable_damping(device);
  PerceptRenderer percept(pp);
  FeedbackParameters fp{.joint_count = kLoopJoints, .law = law};
  const double inverse_a[] = {0, 0.05, 0.05, 1, 1};
  for (std::size_t i = 0; i < kBilateralLaws; ++i) fp.inverse_a[i] = everywhere(inverse_a[i]);
  for (std::size_t j = 0; j < kLoopJoints; ++j) {
    fp.torque_cap_Nm[j] = 4.0;
    fp.exchange.k_p[j] = 15.0, fp.exchange.k_v[j] = 0.2, fp.exchange.force_share = force_share;
    fp.passivity.allowance_J[j] = 0.02, fp.passivity.store_J[j] = 0.1;
    fp.passivity.damping_limit[j] = pp.damping_limit_Nms_per_rad[j];
  }
  fp.passivity.joint_count = kLoopJoints;
  FeedbackRenderer feedback_renderer(fp);
  TorqueSlew slew({.joint_count = kLoopJoints,
                   .percept_cap_Nm = pp.torque_cap_Nm,
                   .feedback_cap_Nm = fp.torque_cap_Nm,
                   .limit_Nm = everywhere(6.0),
                   .rate_Nm_per_s = everywhere(310.0)});
  struct Packet {
    core::JointArray q, v;
  };
  std::deque<Packet> to_slave(static_cast<std::size_t>(network_delay_ticks) + 1, Packet{});
  struct WallAnswer {
    JointMotion motion;
    SlaveEffort effort;
    bool contact = false;
  };
  std::deque<WallAnswer> to_master(static_cast<std::size_t>(network_delay_ticks) + 1, WallAnswer{});
  std::deque<DragCoefficients> field(static_cast<std::size_t>(2 * network_delay_ticks) + 1);

  core::JointArray target{};
  target[0] = 0.55;  // the tip would go 7 cm into the wall
  hand.move_to(target, 2.0);
  Outcome out;
  double last_low_Nm = 1e9, last_high_Nm = -1e9;
  for (double t = 0; t < 6.0; t += kDt) {
    const auto& v = master.velocity();
    const auto rendered = percept.step(field.front(), true, percept_on, everywhere(15.0), v, kDt);
    const WallAnswer& heard = to_master.front();
    const auto feedback = feedback_renderer
                              .step({.law = law,
                                     .coupled = true,
                                     .contact = heard.contact,
                                     .force_measured = true,
                                     .master = {master.position(), v},
                                     .slave = heard.motion,
                                     .effort = heard.effort},
                                    kDt)
                              .torque_Nm;
    double power_W = 0.0;
    for (std::size_t j = 0; j < kLoopJoints; ++j) power_W += rendered.torque_Nm[j] * v[j];
    out.greatest_power_W = std::max(out.greatest_power_W, power_W);
    out.percept_energy_J += power_W * kDt;
    master.step(hand.step(master.true_position(), master.true_velocity(), true, kDt),
                slew.step(rendered.torque_Nm, feedback, v, kDt).motor_Nm, kDt);

    to_slave.push_back({master.position(), master.velocity()});
    const Packet command = to_slave.front();
    to_slave.pop_front();
    const auto torque = servo.step(command.q, command.v, slave.position(), slave.velocity(), {});
    slave.step(torque.drive_Nm, kDt);
    to_master.push_back({{slave.position(), slave.velocity()},
                         {torque.loop_Nm, slave.contact().joint_torque_Nm},
                         slave.contact().contact});
    to_master.pop_front();
    field.push_back(drag_at(arm, slave.position(), wall));
    field.pop_front();

    const auto& report = slave.contact();
    out.greatest_force_N = std::max(out.greatest_force_N, report.force_N);
    if (report.contact && out.contact_s < 0) {
      out.contact_s = t;
      out.contact_speed_m_s = slave.tool_speed_m_s();
    }
    if (out.contact_s < 0) {
      const double torque_Nm = std::abs(rendered.torque_Nm[0]);
      out.peak_percept_Nm = std::max(out.peak_percept_Nm, torque_Nm);
      if (report.clearance_m < 0 || report.clearance_m > 0.13)
        out.far_percept_Nm = std::max(out.far_percept_Nm, torque_Nm);
    } else {
      out.feedback_at_contact_Nm = std::max(out.feedback_at_contact_Nm, std::abs(feedback[0]));
    }
    EXPECT_TRUE(std::isfinite(slave.true_position()[0]));
    if (t > 5.0)
      last_low_Nm = std::min(last_low_Nm, feedback[0]), last_high_Nm = std::max(last_high_Nm, feedback[0]);
  }
  out.last_swing_Nm = last_high_Nm - last_low_Nm;
  return out;
}

TEST(ClosedLoop, PerceptWarnsBeforeContactAndSlowsTheOperatorInEveryLaw) {
  for (const auto law : {BilateralLaw::kPf, BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe,
                         BilateralLaw::kPeff}) {
    for (const int delay : {0, 2, 10}) {
      const auto with = reach_the_wall(true, law, delay);
      const auto without = reach_the_wall(false, law, delay);
      SCOPED_TRACE(std::string(name_of(law)) + ", delay of " + std::to_string(delay) + " ms");
      ASSERT_GE(with.contact_s, 0.0);
      ASSERT_GE(without.contact_s, 0.0);
      EXPECT_LT(with.contact_speed_m_s, 0.9 * without.contact_speed_m_s);
      EXPECT_GT(with.peak_percept_Nm, 0.5);  // felt before the contact
      EXPECT_LE(with.peak_percept_Nm, 2.2 + 1e-9);
      EXPECT_LT(with.far_percept_Nm, 1e-9);     // and nothing in free space
      EXPECT_LE(with.greatest_power_W, 1e-12);  // at no time drives it the hand
      EXPECT_LT(with.percept_energy_J, -0.01);
      EXPECT_EQ(without.percept_energy_J, 0.0);
    }
  }
}

TEST(ClosedLoop, ContactIsFeltInEveryLawButPositionForward) {
  EXPECT_EQ(reach_the_wall(true, BilateralLaw::kPf, 2).feedback_at_contact_Nm, 0.0);
  for (const auto law : {BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
    EXPECT_GT(reach_the_wall(true, law, 2).feedback_at_contact_Nm, 0.4) << name_of(law);
  }
}

TEST(ClosedLoop, ContactComesToRestInEveryLaw) {
  for (const auto law : {BilateralLaw::kSctfb, BilateralLaw::kPfff, BilateralLaw::kPe, BilateralLaw::kPeff}) {
    for (const int delay : {0, 2, 5}) {
      EXPECT_LT(reach_the_wall(true, law, delay).last_swing_Nm, 0.3)
          << name_of(law) << ", delay of " << delay << " ms";
    }
  }
  // A strong arm's whole force on a weak master hammers between the caps: why there is a force share.
  EXPECT_GT(reach_the_wall(true, BilateralLaw::kPeff, 2, 1.0).last_swing_Nm, 0.5);
}

}  // namespace
}  // namespace phantom::teleop
