#include "components/simulated_drive/force_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "common/core/errors.hpp"
#include "components/simulated_drive/config.hpp"
#include "tests/support/files.hpp"
#include "tests/support/local_bus.hpp"

namespace phantom::simulated_drive {
namespace {

using Eigen::Vector3d;

ForceSensorOptions sensor_options() {
  ForceSensorOptions o;
  o.axis_at_m = {0.0, 0.0, -0.4};
  o.touches_at_m = {0.01, 0.02, 0.15};
  o.weight_N = {0.0, 0.0, -12.0};
  o.weight_at_m = {0.0, 0.03, 0.08};
  return o;
}

/// A motor with a wall, and the sensor; its frames are read by hand.
struct ForceSensorBench {
  explicit ForceSensorBench(const ForceSensorOptions& with)
      : options(with),
        motor({.wall = {.at_rad = 0.2, .stiffness_Nm_per_rad = 2000.0, .damping_Nms_per_rad = 5.0},
               .joint = {.inertia = 0.05, .viscous = 0.0, .coulomb = 0.0, .lower = -10.0, .upper = 10.0}}),
        sensor(options, motor, bus.connect("sensor")) {}

  void run(double torque_Nm, int ticks) {
    for (int i = 0; i < ticks; ++i) {
      for (int k = 0; k < 4; ++k)
        motor.step(torque_Nm / (1e-3 * motor.parameters().rated_torque_Nm * motor.parameters().gear_ratio),
                   kSubStep_s);
      now_ns += core::kNsPerMillisecond;
      sensor.step(now_ns);
      bus.advance_to(now_ns);
      can::Received received;
      while (reader->receive(received)) {
        if (!received.is_frame()) continue;
        const can::CanFrame& frame = received.frame;
        Vector3d& values = frame.id == options.id ? force_N : torque_Nm_;
        for (int axis = 0; axis < 3; ++axis) {
          const int low = frame.data[static_cast<std::size_t>(2 * axis)],
                    high = frame.data[static_cast<std::size_t>(2 * axis + 1)];
          const int count = low + 256 * (high < 128 ? high : high - 256);
          values[axis] = count * (frame.id == options.id ? options.count_N : options.count_Nm);
        }
        if (frame.id == options.id) status = frame.data[6];
        ++frames;
      }
    }
  }

  ForceSensorOptions options;
  simulation::LocalBus bus;
  std::unique_ptr<can::CanBus> reader = bus.connect("reader");
  Motor motor;
  SimulatedForceSensor sensor;
  core::Nanoseconds now_ns = 0;
  Vector3d force_N = Vector3d::Zero(), torque_Nm_ = Vector3d::Zero();
  int frames = 0, status = 0;
};

TEST(SimulatedForceSensor, AtRestItShowsWeightAndOffsetTwiceInEachPeriod) {
  auto options = sensor_options();
  options.offset_N = 3.0;
  options.offset_Nm = -0.1;
  options.drift_N_per_s = 0.5;
  ForceSensorBench bench(options);
  bench.run(0.0, 1000);
  EXPECT_NEAR(bench.frames, 2 * 500, 4);
  EXPECT_EQ(bench.status, 0x80);
  EXPECT_LT((bench.force_N - Vector3d(3.5, 3.5, -8.5)).norm(), 0.03);
  const Vector3d torque_Nm = options.weight_at_m.cross(options.weight_N) + Vector3d::Constant(-0.1);
  EXPECT_LT((bench.torque_Nm_ - torque_Nm).norm(), 0.002);
}

// What the sensor feels turns the joint as the wall does: about the joint's axis its wrench is the wall's.
TEST(SimulatedForceSensor, ItsForceExertsTheWallsTorqueOnTheJoint) {
  auto options = sensor_options();
  options.weight_N = Vector3d::Zero();
  ForceSensorBench bench(options);
  bench.run(8.0, 3000);
  ASSERT_NEAR(bench.motor.wall_torque_Nm(), -8.0, 1e-3);
  const double about_axis_Nm =
      options.axis.dot(bench.torque_Nm_ + (Vector3d::Zero() - options.axis_at_m).cross(bench.force_N));
  EXPECT_NEAR(about_axis_Nm, -8.0, 0.02);
  EXPECT_NEAR(bench.force_N.norm(), 8.0 / 0.55, 0.03) << "0.55 m from the axis";
}

TEST(SimulatedForceSensor, TheWeightTurnsWithTheJoint) {
  auto options = sensor_options();
  ForceSensorBench bench(options);
  bench.run(1.0, 100);
  const double q = bench.motor.joint_rad();
  ASSERT_GT(q, 0.02);
  // The sensor turns by q about y: seen from it, what hangs down swings back.
  EXPECT_LT((bench.force_N - Vector3d(12.0 * std::sin(q), 0.0, -12.0 * std::cos(q))).norm(), 0.05);
}

TEST(SimulatedForceSensor, BeyondItsRangeItSaysSo) {
  auto options = sensor_options();
  options.count_N = 0.0001;  // ±3.3 N
  ForceSensorBench bench(options);
  bench.run(0.0, 10);
  EXPECT_EQ(bench.status, 0x81);
}

// What load_config says of the shipped file with the example's section in use, and one of its lines changed.
std::string problem_of_sensor(const std::string& from, const std::string& to) {
  std::string text = test::read_text(PHANTOM_SOURCE_DIR "/components/simulated_drive/simulated_drive.yaml");
  const auto begin = text.find("# force_torque_sensor:");
  std::string section;
  std::istringstream lines(text.substr(begin));
  for (std::string line; std::getline(lines, line);) section += line.substr(2) + "\n";
  const auto file = test::new_folder() / "simulated_drive.yaml";
  std::ofstream(file) << text.substr(0, begin) << test::replaced(section, from, to);
  try {
    return std::to_string(load_config(file).force_sensor.value().lever_m());
  } catch (const core::ConfigError& error) {
    return error.what();
  }
}

TEST(ForceSensorConfig, TheExampleIsValidAndWhatCouldNotBeIsRefused) {
  EXPECT_EQ(problem_of_sensor("rate_Hz: 500", "rate_Hz: 400"), "0.550000");
  EXPECT_THAT(problem_of_sensor("node: 1 ", "node: 9 "),
              testing::HasSubstr("force_torque_sensor.node: '9' is none of the drives"));
  EXPECT_THAT(problem_of_sensor("normal: [1, 0, 0]", "normal: [0, 0, 1]"),
              testing::HasSubstr("acts nearly through the joint's axis"));
  EXPECT_THAT(problem_of_sensor("axis: [0, 1, 0]", "axis: [0, 0, 0]"),
              testing::HasSubstr("has no direction"));
}

}  // namespace
}  // namespace phantom::simulated_drive
