// The sensor at the wrist on the drives' bus: simulated drives that meet a wall, and the simulated sensor
// that feels it, on buses in this process.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>

#include "common/teleop/rendering/feedback_rendering.hpp"
#include "components/simulated_drive/force_sensor.hpp"
#include "components/slave_io/tests/arm_bench.hpp"
#include "components/slave_io/tests/wrist_section.hpp"

namespace phantom::slave_io {
namespace {

using teleop::LinkState;

constexpr std::size_t kWalled = 3;
constexpr double kNoise_N = 0.3, kNoise_Nm = 0.01;

void with_wall_for_the_tool(std::size_t j, simulated_drive::DriveOptions& options) {
  if (j == kWalled)
    options.motor.wall = {
        .at_rad = options.motor.start_rad + 0.1, .stiffness_Nm_per_rad = 5000.0, .damping_Nms_per_rad = 20.0};
}

Config with_wrist(bool observer) {
  Config config = can_config();
  config.wrist = wrist_config();
  if (!observer) config.force_observer.reset();
  return config;
}

/// The sensor where the configuration says, with the payload that it says, an offset that drifts, and noise.
/// The tool's tip meets the elbow's wall.
simulated_drive::ForceSensorOptions sensor_options(const WristSensorConfig& config) {
  const robot::SerialArm& arm = shipped_arm().arm;
  robot::LinkPoses X_WL;
  arm.link_poses(shipped_arm().home, X_WL);
  const geometry::Pose X_SW = (X_WL[7] * config.sensor.X_LS).inverse();
  simulated_drive::ForceSensorOptions o;
  o.axis = X_SW.rotation * arm.axis_W(kWalled, X_WL);
  o.axis_at_m = X_SW * arm.axis_point_W(kWalled, X_WL);
  o.touches_at_m = X_SW * (X_WL[7] * shipped_arm().tip_in_last_link_m);
  o.normal = o.axis.cross(o.touches_at_m - o.axis_at_m).normalized();
  o.weight_N = X_SW.rotation * Eigen::Vector3d(0, 0, -9.80665 * config.sensor.payload_kg);
  o.weight_at_m = config.sensor.payload_centre_m;
  o.noise_N = kNoise_N;
  o.noise_Nm = kNoise_Nm;
  o.offset_N = 5.0;
  o.offset_Nm = -0.3;
  o.drift_N_per_s = 0.02;
  o.drift_Nm_per_s = 0.001;
  return o;
}

struct WristWallBench : ArmBench {
  explicit WristWallBench(bool observer = true)
      : ArmBench(with_wrist(observer), shipped_arm().home, with_wall_for_the_tool),
        options(sensor_options(*config.wrist)),
        sensor(options, drives[kWalled]->motor(), rig.buses[1]->connect("sensor")),
        input(shipped_arm(), *config.wrist, inbox, rig.buses[1]->connect("slave_io's wrist")) {
    servo = std::make_unique<Servo>(shipped_arm(), config, *arm, inbox, 1, stops, nullptr, &input);
  }
  void tick() {
    ArmBench::tick();
    sensor.step(now_ns + period_ns);
  }
  void run(double duration_s) {
    for (double t = 0; t < duration_s; t += config.period_s) tick();
  }
  /// Coupled, and the sensor tared.
  bool ready() {
    const bool coupled = ServoRig::reaches(LinkState::kCoupled, config.period_s, 10.0, [this] { tick(); });
    run(0.1);
    const core::Status asked = inbox.tare.ask();
    EXPECT_TRUE(asked) << asked.message();
    run(0.5);
    return coupled && last.force_measured;
  }
  void lead(double speed) {
    master.velocity[kWalled] = speed;
    master.position[kWalled] += speed * config.period_s;
    tick();
  }
  double wall_Nm() const { return drives[kWalled]->motor().wall_torque_Nm(); }
  /// By how much the thresholds make the elbow's torque too small at most, with what noise and drift do.
  double short_by_Nm() const {
    const auto& s = config.wrist->sensor;
    return (s.threshold_N + 4 * kNoise_N) * options.axis_at_m.norm() + s.threshold_Nm + 4 * kNoise_Nm;
  }

  simulated_drive::ForceSensorOptions options;
  simulated_drive::SimulatedForceSensor sensor;
  WristInput input;
};

TEST(WristOnCan, FreeMotionIsNoContactAndTheWallIsFeltAtThePlaceWhereTheToolMeetsIt) {
  for (const bool observer : {false, true}) {
    WristWallBench bench(observer);
    ASSERT_TRUE(bench.ready());
    int contacts = 0;
    for (int i = 0; i < 250; ++i) {
      bench.lead(0.15);  // 75 mrad, with the payload turning along
      contacts += bench.last.contact ? 1 : 0;
      EXPECT_TRUE(bench.last.force_measured);
      EXPECT_EQ(bench.last.external_torque_Nm, core::JointArray{});
    }
    EXPECT_EQ(contacts, 0);
    for (int i = 0; i < 100; ++i) bench.lead(0.2);
    bench.run(0.5);
    const double wall_Nm = bench.wall_Nm();
    EXPECT_LT(wall_Nm, -15.0);
    EXPECT_TRUE(bench.last.contact);
    EXPECT_NEAR(bench.last.contact_force_N, std::abs(bench.sensor.wall_force_N()), 4 * kNoise_N);
    EXPECT_GT(bench.last.external_torque_Nm[kWalled], wall_Nm - 1.0);
    EXPECT_LT(bench.last.external_torque_Nm[kWalled], wall_Nm + bench.short_by_Nm());
    robot::LinkPoses X_WL;
    shipped_arm().arm.link_poses(bench.last.position, X_WL);
    const Eigen::Vector3d tip_m = X_WL[7] * shipped_arm().tip_in_last_link_m;
    EXPECT_LT((Eigen::Vector3d(bench.last.contact_point_m.data()) - tip_m).norm(), 0.02);
    for (int i = 0; i < 200; ++i) bench.lead(-0.2);
    bench.run(0.3);
    EXPECT_FALSE(bench.last.contact);
    EXPECT_EQ(bench.last.external_torque_Nm[kWalled], 0.0);
  }
}

// Cycle by cycle the force is the wall's behind the filter, now or as old as is stated at most.
TEST(WristOnCan, LagsTheWallAsStated) {
  WristWallBench bench;
  ASSERT_TRUE(bench.ready());
  const double filter_s = bench.config.wrist->sensor.filter_s, period_s = bench.config.period_s;
  const auto cycles = std::llround((force_lag_s(*bench.config.wrist, period_s) - filter_s) / period_s);
  std::deque<double> expected_N(1, 0.0);
  double low_pass_N = 0.0, worst_N = 0.0, most_N = 0.0;
  for (const double speed : {0.25, 0.0, -0.25}) {
    for (int i = 0; i < 250; ++i) {
      low_pass_N += period_s / (filter_s + period_s) * (std::abs(bench.sensor.wall_force_N()) - low_pass_N);
      expected_N.push_back(low_pass_N);
      if (expected_N.size() > static_cast<std::size_t>(cycles) + 1) expected_N.pop_front();
      bench.lead(speed);
      const auto [least, most] = std::minmax_element(expected_N.begin(), expected_N.end());
      worst_N = std::max({worst_N, *least - bench.last.wrist.force_N, bench.last.wrist.force_N - *most});
      most_N = std::max(most_N, low_pass_N);
    }
  }
  EXPECT_LE(cycles, 3);
  EXPECT_GT(most_N, 30.0);
  EXPECT_LT(worst_N, 5 * kNoise_N + 0.02 * most_N);
}

// The laws that need F_e, as master_io renders them, and a sensor whose torque frame is lost for a while.
TEST(WristOnCan, LawsCAndEFeelTheWallAndFadeWithoutAKickWhileAFrameIsMissing) {
  for (const auto law : {teleop::BilateralLaw::kPfff, teleop::BilateralLaw::kPeff}) {
    teleop::FeedbackParameters parameters{.joint_count = 7, .law = law};
    parameters.inverse_a[static_cast<std::size_t>(law)] = teleop::everywhere(0.05);
    parameters.torque_cap_Nm = teleop::everywhere(4.0);
    parameters.passivity.joint_count = 7;
    parameters.passivity.enabled = false;
    teleop::FeedbackRenderer renderer(parameters);
    WristWallBench bench;
    ASSERT_TRUE(bench.ready());
    teleop::RenderedFeedback felt;
    double free_Nm = 0.0, before_Nm = 0.0, greatest_step_Nm = 0.0;
    const auto render = [&] {
      felt = renderer.step({.law = law,
                            .coupled = true,
                            .contact = bench.last.contact,
                            .force_measured = bench.last.force_measured,
                            .effort = {bench.last.loop_torque_Nm, bench.last.external_torque_Nm}},
                           bench.config.period_s);
      greatest_step_Nm = std::max(greatest_step_Nm, std::abs(felt.torque_Nm[kWalled] - before_Nm));
      before_Nm = felt.torque_Nm[kWalled];
    };
    for (int i = 0; i < 450; ++i) {
      bench.lead(i < 250 ? 0.25 : 0.0);
      render();
      EXPECT_FALSE(felt.force_missing);
      if (bench.wall_Nm() == 0.0) free_Nm = std::max(free_Nm, std::abs(felt.torque_Nm[kWalled]));
    }
    EXPECT_EQ(free_Nm, 0.0);
    EXPECT_LT(felt.torque_Nm[kWalled], 0.05 * (bench.wall_Nm() + bench.short_by_Nm()));
    EXPECT_LT(felt.torque_Nm[kWalled], -1.0);
    const double whole_Nm = std::abs(felt.torque_Nm[kWalled]);
    greatest_step_Nm = 0.0;
    bench.rig.buses[1]->set_faults({{.id = 417, .mask = 0x7FF, .drop = 1.0}});
    for (int i = 0; i < 150; ++i) {
      bench.lead(0.0);
      render();
    }
    EXPECT_TRUE(felt.force_missing);
    EXPECT_EQ(felt.torque_Nm[kWalled], 0.0);
    bench.rig.buses[1]->set_faults({});
    for (int i = 0; i < 300; ++i) {
      bench.lead(0.0);
      render();
    }
    EXPECT_FALSE(felt.force_missing);
    EXPECT_NEAR(std::abs(felt.torque_Nm[kWalled]), whole_Nm, 0.15);
    EXPECT_LT(greatest_step_Nm, 1.1 * whole_Nm * bench.config.period_s / 0.1 + 0.05 * 5 * kNoise_N);
  }
}

// A slow drift goes with the next tare; a tare against the wall is refused.
TEST(WristOnCan, ATareTakesTheDriftAwayAndIsRefusedAtTheWall) {
  WristWallBench bench;
  ASSERT_TRUE(bench.ready());
  const double offset_N = bench.last.wrist.offset_N;
  EXPECT_NEAR(offset_N, std::sqrt(3.0) * (5.0 + 0.02 * 1.0), 0.3);
  bench.run(20.0);
  EXPECT_GT(bench.last.wrist.force_N, 0.4);
  EXPECT_TRUE(bench.inbox.tare.ask());
  bench.run(0.5);
  EXPECT_EQ(bench.last.wrist.tare, teleop::TareState::kDone);
  EXPECT_GT(bench.last.wrist.offset_N, offset_N + 0.4);
  for (int i = 0; i < 250; ++i) bench.lead(0.25);
  bench.run(0.5);
  ASSERT_TRUE(bench.last.contact);
  EXPECT_FALSE(bench.inbox.tare.ask());
}

}  // namespace
}  // namespace phantom::slave_io
