#include "components/master_io/devices/cartesian_device.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "components/master_io/dds_adapter_convert.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;
constexpr double kTick_s = 0.001;
const std::filesystem::path kCartesianSite = PHANTOM_SOURCE_DIR "/deploy/cartesian/hot_cell_master_io.yaml";

Config site_config() {
  return load_config(kCartesianSite, hot_cell().file, shipped_arm().arm, shipped_arm().home, {});
}

/// The servo with a simulated Cartesian device and a slave that follows perfectly.
struct CartesianRig : ServoRig {
  explicit CartesianRig(const Config& chosen = site_config())
      : config(chosen),
        device(config, shipped_arm().arm, shipped_arm().home),
        servo(config, shipped_arm().home, device, inbox, 1, stops) {
    slave.position = last.position = shipped_arm().home;
    drag.drag.plus.fill(0.1);
    drag.drag.minus.fill(0.1);
  }

  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += kTick_s) {
      now_ns += core::from_seconds(kTick_s);
      if (heard) {
        renew(slave);
        renew(drag);
        if (!slave_waits && last.outputs.state != LinkState::kInit) slave.position = last.position;
        inbox.slave.write(slave);
        inbox.drag.write(drag);
      }
      const auto before = device.wrench();
      const auto was_at = last.position;
      {
        const test::HeapGuard guard;
        tick(servo, kTick_s);
      }
      check(before, was_at);
    }
  }

  void check(const robot::Spatial& before, const core::JointArray& was_at) {
    double percept_W = 0.0, joints_W = 0.0;
    for (std::size_t j = 0; j < 7; ++j) {
      percept_W += last.percept_torque_Nm[j] * last.velocity[j];
      joints_W += last.outputs.motor_Nm[j] * last.velocity[j];
      const double most = shipped_arm().arm.joints()[j].max_speed * kTick_s;
      if (was_at != core::JointArray{}) {
        EXPECT_LE(std::abs(last.position[j] - was_at[j]), most) << "joint " << j << " jumped";
      }
    }
    EXPECT_LE(percept_W, 1e-12);
    EXPECT_LE(device.wrench().dot(device.twist()), std::max(0.0, joints_W) + 1e-9) << "passivity";
    const double change_N = (device.wrench() - before).head<3>().norm();
    if (before.dot(device.twist()) <= 0.0) {
      EXPECT_LE(change_N, config.cartesian->wrench.force_rate_N_per_s * kTick_s + 1e-9)
          << "a step of the force";
    }
  }

  Config config;
  CartesianDevice device;
  Servo servo;
  bool slave_waits = false;
};

TEST(CartesianDevice, ReachesIntoTheCellWithDragAndClutchWithoutAStep) {
  CartesianRig rig;
  rig.run(40.0);
  const auto& log = rig.servo.reaches();
  ASSERT_GE(log.size(), 2U);
  EXPECT_TRUE(log[0].percept);
  EXPECT_GT(log[0].peak_percept_Nm, 0.01);
  const CartesianFigures& figures = *rig.device.cartesian_figures();
  EXPECT_GT(figures.clutched_out, 2U) << "the handle's workspace is smaller than the reach";
  EXPECT_GT(figures.greatest_force_N, 0.1) << "drag is felt";
  EXPECT_GT(figures.energy_from_hand_J, 0.0);
  EXPECT_LE(figures.greatest_excess_W, 1e-9);
}

TEST(CartesianDevice, TheToolArrivesWhereTheReachSays) {
  Config config = site_config();
  config.script.percept = simulation::PerceptSchedule::kOff;
  config.script.overreach = 0.0;
  const core::JointArray target = config.script.reaches[0].target;
  CartesianRig rig(config);
  double nearest_m = 1.0;
  for (int i = 0; i < 300; ++i) {
    rig.run(0.1);
    const auto at = rig.device.sense(rig.now_ns).hand_position;
    nearest_m = std::min(nearest_m, config.cartesian->hand.scale *
                                        std::hypot(at[0] - target[0], at[1] - target[1], at[2] - target[2]));
  }
  EXPECT_LT(nearest_m, 0.01);
}

TEST(CartesianDevice, SR13_TheGuardCountsWhatAWeakHandRendersAndNoMore) {
  for (const bool weak : {true, false}) {
    Config config = site_config();
    if (weak) config.cartesian->wrench.force_cap_N = config.cartesian->wrench.moment_cap_N_m = 0.01;
    CartesianRig rig(config);
    bool damped = false;
    for (double t = 0.0; t < 8.0; t += kTick_s) {
      for (std::size_t j = 0; j < 7; ++j)
        rig.slave.loop_torque_Nm[j] = -1000.0 * std::clamp(20.0 * rig.last.velocity[j], -1.0, 1.0);
      rig.run(kTick_s);
      damped = damped || rig.last.feedback_damped;
    }
    EXPECT_EQ(damped, !weak);
  }
}

TEST(CartesianDevice, TheMasterGoesToASlaveThatWaits) {
  CartesianRig rig;
  rig.slave.state = LinkState::kReady;
  rig.slave_waits = true;
  rig.slave.position[3] += 0.3;
  rig.run(1.5);
  EXPECT_NEAR(rig.last.position[3], rig.slave.position[3], 1e-6);
  EXPECT_EQ(rig.last.outputs.state, LinkState::kAligned);
}

TEST(CartesianDevice, NothingMovesWhileNothingIsCoupled) {
  CartesianRig rig;
  rig.heard = false;
  rig.run(3.0);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_EQ(rig.last.position[j], shipped_arm().home[j]);
  EXPECT_EQ(rig.device.wrench().norm(), 0.0);
}

// Tries master_io: that of a Cartesian master
TEST(CartesianDevice, ASpaceMouseLeadsTheToolAtPushByBrakeAndItsClutchHoldsIt) {
  const auto file = changed("  input: simulated", "  input: space_mouse", kCartesianSite);
  CartesianRig rig(load_config(file, hot_cell().file, shipped_arm().arm, shipped_arm().home, {}));
  rig.drag.drag.plus.fill(0.0);
  rig.drag.drag.minus.fill(0.0);
  rig.run(1.0);
  ASSERT_EQ(rig.last.outputs.state, LinkState::kCoupled);
  EXPECT_EQ(rig.last.reach, -1) << "nothing is scripted";
  const auto tool = [&] { return tool_pose_at(shipped_arm().arm, rig.last.position).translation_m; };
  DeskState mouse{.alive = true};
  rig.servo.desk.write(mouse);
  rig.run(0.5);
  const Eigen::Vector3d start = tool();
  mouse.axes[1] = 1.0;
  rig.servo.desk.write(mouse);
  rig.run(1.0);
  const double scale = rig.config.cartesian->hand.scale;
  const double wanted_m = scale * rig.config.desk.push[1] / rig.config.desk.brake[1];
  EXPECT_NEAR((tool() - start).y(), wanted_m, 0.15 * wanted_m);
  mouse.clutch_out = true;
  rig.servo.desk.write(mouse);
  rig.run(0.3);
  const Eigen::Vector3d held = tool();
  rig.run(1.0);
  EXPECT_LT((tool() - held).norm(), 1e-12);
  mouse.alive = mouse.clutch_out = false;
  rig.servo.desk.write(mouse);
  rig.run(1.0);
  EXPECT_LT((tool() - held).norm(), 1e-12) << "a mouse that is gone leads nothing";
}

TEST(CartesianDevice, InFrameViewTheToolMovesAsItIsSeenOrWithoutAViewAsTheBaseStands) {
  const auto mouse_file = changed("  input: simulated", "  input: space_mouse", kCartesianSite);
  const auto file = changed("  frame: base", "  frame: view", mouse_file);
  const auto config = load_config(file, hot_cell().file, shipped_arm().arm, shipped_arm().home, {});
  for (const bool viewed : {true, false}) {
    CartesianRig rig(config);
    rig.drag.drag.plus.fill(0.0);
    rig.drag.drag.minus.fill(0.0);
    messages::ViewPose view;
    view.X_WC.rotation = geometry::rotation_from_rpy(0.0, 0.0, 3.14159265 / 2);  // its right is W's y
    DeskState mouse{.alive = true};
    const auto run = [&](double duration_s) {
      rig.servo.desk.write(mouse);
      for (double t = 0; t < duration_s; t += 0.1) {
        if (viewed) rig.inbox.view.write(seen(view, rig.now_ns));
        rig.run(0.1);
      }
    };
    mouse.clutch_out = true;
    run(1.0);
    mouse.clutch_out = false;
    run(0.5);
    const auto tool = [&] { return tool_pose_at(shipped_arm().arm, rig.last.position).translation_m; };
    const Eigen::Vector3d start = tool();
    mouse.axes[0] = 0.5;
    run(0.5);
    const Eigen::Vector3d moved = (tool() - start).normalized();
    EXPECT_GT(viewed ? moved.y() : moved.x(), 0.99) << moved.transpose();
  }
}

TEST(CartesianConfig, ReadsItsSectionAndRefusesWhatCannotBe) {
  const auto config = site_config();
  EXPECT_EQ(config.driver, Driver::kCartesian);
  EXPECT_EQ(config.script.joint_count, kCartesianAxes);
  const auto problem = [](const std::string& from, const std::string& to) {
    try {
      load_config(changed(from, to, kCartesianSite), hot_cell().file, shipped_arm().arm, shipped_arm().home,
                  {});
    } catch (const core::ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(problem("frame: base", "frame: moon").find("frame"), std::string::npos);
  EXPECT_NE(problem("  scale: ", "  scale: -").find("scale"), std::string::npos);
  EXPECT_NE(problem("  mass_kg: 1\n", "").find("mass_kg"), std::string::npos);
}

}  // namespace
}  // namespace phantom::master_io
