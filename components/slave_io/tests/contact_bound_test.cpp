// The arm presses no harder than its joints, and what it touches, may bear.
#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/kinematics/jacobian.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/force_bounds.hpp"
#include "components/slave_io/session.hpp"
#include "components/slave_io/slave_io.hpp"
#include "components/slave_io/tests/slave_rig.hpp"

namespace phantom::slave_io::contact_bound_test {
namespace {

using slave_rig::kDt;
using slave_rig::kJoints;
using slave_rig::ServoRig;
using teleop::LinkState;

/// Presses the arm's tip on a floor with its gantry's target far below; the greatest share of a joint's
/// effort that the floor exerts, once the impact is over.
double pressed_share(const Config& config, SlaveReport& last) {
  ServoRig bench;
  robot::LinkPoses X_WL;
  shipped_arm().arm.link_poses(shipped_arm().home, X_WL);
  const double tip_m = (X_WL[kJoints] * shipped_arm().tip_in_last_link_m).z();
  const robot::Jacobian J = robot::tool_jacobian(shipped_arm().arm, X_WL);
  const simulation::HalfSpace below(Eigen::Vector3d::UnitZ(), tip_m - 0.08);
  SimulatedArm arm(shipped_arm(), config, below);
  Servo servo(shipped_arm(), config, arm, bench.inbox, 1, bench.stops);
  double greatest = 0.0;
  const auto run = [&](double duration_s, bool held) {
    for (double t = 0.0; t < duration_s; t += kDt) {
      bench.now_ns += core::from_seconds(kDt);
      bench.renew(bench.master);
      bench.inbox.master.write(bench.master);
      bench.tick(servo, kDt);
      for (std::size_t j = 0; held && j < kJoints; ++j)
        greatest = std::max(
            greatest, std::abs(bench.last.external_torque_Nm[j]) / shipped_arm().arm.joints()[j].max_effort);
    }
  };
  run(0.5, false);
  for (int i = 0; i < 2000; ++i) {
    for (std::size_t j = 1; j < kJoints; ++j)  // downwards
      bench.master.position[j] -= 0.001 * J(2, static_cast<Eigen::Index>(j));
    run(kDt, false);
  }
  run(3.0, false);
  run(0.5, true);
  last = bench.last;
  return greatest;
}

// Tries slave_io: the arm presses on something as hard as `contact_limit` allows
TEST(ContactBound, SR22_PressesNoHarderThanItMayAndSaysSo) {
  SlaveReport last;
  Config config = shipped_config();
  for (double& bound : config.contact_limit.torque_Nm) bound = 0.0;
  const double unbounded = pressed_share(config, last);
  ASSERT_GT(unbounded, 0.1) << "it presses";
  EXPECT_EQ(last.outputs.pressing_joint, -1);
  const double share = 0.5 * unbounded;
  for (std::size_t j = 0; j < kJoints; ++j)
    config.contact_limit.torque_Nm[j] = share * shipped_arm().arm.joints()[j].max_effort;
  EXPECT_NEAR(pressed_share(config, last), share, 0.03 * share);
  ASSERT_GE(last.outputs.pressing_joint, 0);
  EXPECT_EQ(last.outputs.state, LinkState::kCoupled);
  EXPECT_NE(sentence(last.outputs, shipped_arm().arm).find("as hard as it may"), std::string::npos);
}

/// A coupled arm that is touched with a force against its way, and is led on for a second.
struct TouchedSlave {
  TouchedSlave(const std::vector<ObjectForceBound>& bounds, std::uint16_t object, double force_N) {
    Config config = shipped_config();
    for (double& bound : config.contact_limit.torque_Nm) bound *= 10.0;  // no joint's own bound is reached
    config.object_bounds = bounds;
    SlaveIo controller(shipped_arm().arm, config, shipped_arm().home, teleop::StopLatch(1, {}));
    SlaveInputs in;
    in.position = in.master.position = shipped_arm().home;
    in.master.state = LinkState::kCoupled;
    in.partner_age_s = 0.001;
    for (int i = 0; i < 500; ++i) out = controller.step(in, kDt);
    in.force_measured = in.contact = true;
    in.contact_force_N = force_N;
    in.contact_object = object;
    in.external_Nm[3] = -50.0;
    in.master.position[3] += 0.2;
    for (int i = 0; i < 1000; ++i) out = controller.step(in, kDt);
    held = out.reference[3] < in.master.position[3] - 0.1;
  }
  SlaveOutputs out;
  bool held = false;
};

TEST(ContactBound, SR22_PressesOnAnObjectNoHarderThanThatBearsAndNamesIt) {
  const std::vector<ObjectForceBound> bounds{{2, "gauge", 8.0}, {5, "window", 20.0}};
  const TouchedSlave gauge(bounds, 2, 8.0);
  EXPECT_TRUE(gauge.held);
  EXPECT_EQ(sentence(gauge.out, shipped_arm().arm, bounds),
            "the arm presses on gauge with 8 N, as hard as it may: it goes no farther");
  EXPECT_FALSE(TouchedSlave(bounds, 5, 8.0).held) << "another one bears more";
  EXPECT_FALSE(TouchedSlave(bounds, 3, 100.0).held) << "a third one any force";
  const TouchedSlave unknown(bounds, 0, 8.0);
  EXPECT_TRUE(unknown.held) << "what is not known may be the one that bears least";
  EXPECT_EQ(sentence(unknown.out, shipped_arm().arm, bounds),
            "the arm presses on what may be gauge with 8 N, as hard as it may: it goes no farther");
  EXPECT_FALSE(TouchedSlave({}, 0, 100.0).held);
}

TEST(ContactBound, TheCellFileSaysWhatAnObjectBears) {
  runtime::CellConfig cell;
  cell.objects.resize(3);
  for (std::size_t i = 0; i < 3; ++i) cell.objects[i].id = static_cast<std::uint16_t>(i + 1);
  cell.objects[1].name = "gauge";
  cell.objects[1].max_contact_force_N = 12.0;
  const auto bounds = object_bounds(cell);
  ASSERT_EQ(bounds.size(), 1U);
  EXPECT_EQ(bounds[0].object, 2);
  EXPECT_EQ(bounds[0].name, "gauge");
  EXPECT_EQ(bounds[0].force_N, 12.0);
}

}  // namespace
}  // namespace phantom::slave_io::contact_bound_test
