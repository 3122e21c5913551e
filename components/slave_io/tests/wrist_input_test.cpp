// The sensor at the wrist by topic and by CAN, up to the servo's report.
#include "components/slave_io/wrist_input.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "components/slave_io/tests/arm_bench.hpp"
#include "components/slave_io/tests/wrist_section.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using Eigen::Vector3d;
using teleop::TareRefusal;
using teleop::TareState;
using teleop::WristState;
using testing::HasSubstr;

constexpr core::Nanoseconds kSensorPeriod_ns = 2'000'000;

/// What the sensor at rest shows of the payload, plus a force of the surroundings at its frame's origin.
teleop::Wrench shown_at_home(const WristSensorConfig& config, const Vector3d& force_W_N) {
  robot::LinkPoses X_WL;
  shipped_arm().arm.link_poses(shipped_arm().home, X_WL);
  const Eigen::Matrix3d R_SW = (X_WL[7].rotation * config.sensor.X_LS.rotation).transpose();
  const Vector3d weight_N = R_SW * Vector3d(0, 0, -9.80665 * config.sensor.payload_kg);
  return {R_SW * force_W_N + weight_N, config.sensor.payload_centre_m.cross(weight_N)};
}

/// WristInput with an arm that stands at home.
struct WristInputBench {
  explicit WristInputBench(const std::string& source)
      : config(wrist_config("source: can", "source: " + source)) {
    std::unique_ptr<can::CanBus> bus;
    if (!config.address.empty()) {
      bus = local.connect("slave_io");
      sensor = local.connect("sensor");
      local.advance_to(now_ns);
    }
    input = std::make_unique<WristInput>(shipped_arm(), config, inbox, std::move(bus));
  }
  void send(const teleop::Wrench& w) {
    if (!sensor) {
      wrench.received_ns = now_ns;
      wrench.valid = valid;
      wrench.force_N = messages::vector_of(w.force_N);
      wrench.torque_Nm = messages::vector_of(w.torque_Nm);
      inbox.wrist.write(wrench);
      return;
    }
    // By hand, not by the code under test: little-endian 16-bit counts of 0.02 N and 0.001 N·m.
    for (std::uint32_t f = 0; f < 2; ++f) {
      if (lost == static_cast<int>(f)) continue;
      can::CanFrame frame{.id = 416 + f, .length = 8};
      for (int c = 0; c < 3; ++c) {
        const double value = f == 0 ? w.force_N[c] / 0.02 : w.torque_Nm[c] / 0.001;
        const auto count = static_cast<std::int16_t>(std::lround(value));
        frame.data[static_cast<std::size_t>(2 * c)] = static_cast<std::uint8_t>(count & 0xFF);
        frame.data[static_cast<std::size_t>(2 * c + 1)] = static_cast<std::uint8_t>((count >> 8) & 0xFF);
      }
      frame.data[6] = valid ? 0x80 : 0x81;
      sensor->send(frame);
    }
  }
  const SlaveReport& tick() {
    now_ns += kSensorPeriod_ns;
    if (sends) send(shown_at_home(config, force_W_N));
    if (sensor) local.advance_to(now_ns);
    report = SlaveReport{};
    report.position = shipped_arm().home;
    report.contact = observed;
    report.velocity[2] = speed_rad_s;
    input->step(report, core::seconds(kSensorPeriod_ns), now_ns);
    return report;
  }
  const SlaveReport& run(double duration_s) {
    for (double t = 0; t < duration_s - 1e-9; t += core::seconds(kSensorPeriod_ns)) tick();
    return report;
  }
  void tare() {
    run(0.02);
    ASSERT_TRUE(inbox.tare.ask());
    run(0.5);
    ASSERT_TRUE(report.force_measured);
  }

  WristSensorConfig config;
  simulation::LocalBus local{{.bit_rate = 1e6}};
  std::unique_ptr<can::CanBus> sensor;
  Inbox inbox;
  std::unique_ptr<WristInput> input;
  ReceivedWrench wrench;
  SlaveReport report;
  core::Nanoseconds now_ns = 1'000'000'000;
  bool sends = true, valid = true, observed = false;
  int lost = -1;  // frame of each pair that the bus loses
  double speed_rad_s = 0.0;
  Vector3d force_W_N = Vector3d::Zero();
};

class WristInputBy : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Sources, WristInputBy, testing::Values("topic", "can"));

TEST_P(WristInputBy, AForceOnTheToolIsInTheReport) {
  WristInputBench bench(GetParam());
  bench.tare();
  EXPECT_FALSE(bench.report.contact);
  EXPECT_EQ(bench.report.contact_force_N, 0.0);
  EXPECT_EQ(bench.report.external_torque_Nm, core::JointArray{});
  bench.force_W_N = {0, 25, -10};
  bench.run(0.05);
  EXPECT_TRUE(bench.report.force_measured && bench.report.contact);
  const double size_N = std::hypot(25.0, 10.0);
  EXPECT_NEAR(bench.report.contact_force_N, size_N, 0.05);
  robot::LinkPoses X_WL;
  shipped_arm().arm.link_poses(shipped_arm().home, X_WL);
  const Vector3d origin_m = X_WL[7] * bench.config.sensor.X_LS.translation_m;
  core::JointArray expected{};
  shipped_arm().arm.add_force(7, origin_m, bench.force_W_N * (1.0 - 4.0 / size_N), X_WL, expected);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_NEAR(bench.report.external_torque_Nm[j], expected[j], 0.1) << j;
  const Vector3d found(bench.report.contact_point_m.data());
  EXPECT_LT((found - origin_m).cross(bench.force_W_N.normalized()).norm(), 1e-3) << "on its line of action";
  bench.force_W_N = Vector3d::Zero();
  EXPECT_FALSE(bench.run(0.2).contact);
}

// Tries slave_io: the sensor at the wrist is silent
// Tries slave_io: reports an error
TEST_P(WristInputBy, SR11_SilenceAndErrorsAreNotMeasuredAndShownAndOverWhenTheyAre) {
  WristInputBench bench(GetParam());
  bool hinders = false;
  EXPECT_EQ(bench.tick().wrist.state, WristState::kNotTared);
  bench.tare();
  bench.force_W_N = {0, 0, 30};
  bench.run(0.1);
  ASSERT_TRUE(bench.report.contact);
  bench.sends = false;
  bench.run(bench.config.sensor.staleness_s - 0.004);
  EXPECT_TRUE(bench.report.force_measured);
  bench.run(0.006);
  EXPECT_FALSE(bench.report.force_measured || bench.report.contact);
  EXPECT_EQ(bench.report.contact_force_N, -1.0);
  EXPECT_EQ(bench.report.external_torque_Nm, core::JointArray{});
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("lost"));
  EXPECT_TRUE(hinders);
  bench.sends = true;
  EXPECT_FALSE(bench.run(0.04).force_measured);
  EXPECT_TRUE(bench.run(0.02).force_measured);
  bench.valid = false;
  EXPECT_FALSE(bench.tick().force_measured);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("reports an error"));
  bench.valid = true;
  bench.run(0.1);
  EXPECT_TRUE(bench.report.force_measured && bench.report.contact);
  bench.force_W_N = {0, 0, 600};
  EXPECT_FALSE(bench.tick().force_measured);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("beyond its rated range"));
}

TEST(WristInput, BeforeAnythingCameItIsSilent) {
  WristInputBench bench("topic");
  bench.sends = false;
  bool hinders = false;
  EXPECT_EQ(bench.tick().wrist.state, WristState::kSilent);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("has not been heard yet"));
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("does not measure"));
}

TEST(WristInput, OnABusAPartnerFrameThatIsLostMakesItUnknown) {
  for (const int lost : {0, 1}) {
    WristInputBench bench("can");
    bench.tare();
    bench.lost = lost;
    bench.run(0.006);
    EXPECT_TRUE(bench.report.force_measured) << "a pair may be missing";
    bench.run(0.03);
    EXPECT_FALSE(bench.report.force_measured);
    EXPECT_EQ(bench.report.wrist.state, WristState::kStale);
    bench.lost = -1;
    EXPECT_TRUE(bench.run(0.1).force_measured);
  }
}

// Tries slave_io: its bus is off
TEST(WristInput, ABusThatIsOffMakesItUnknownAtOnce) {
  WristInputBench bench("can");
  bench.tare();
  bench.sends = false;
  bench.local.set_bus_off(*bench.input->bus());
  EXPECT_FALSE(bench.tick().force_measured);
  EXPECT_EQ(bench.report.wrist.state, WristState::kInvalid);
}

TEST(WristInput, ContactComesFromEitherTheForceFromTheSensorAlone) {
  WristInputBench bench("can");
  bench.tare();
  bench.observed = true;
  bench.run(0.01);
  EXPECT_TRUE(bench.report.contact);
  EXPECT_EQ(bench.report.contact_force_N, -1.0) << "somewhere else on the arm";
  EXPECT_EQ(bench.report.external_torque_Nm, core::JointArray{});
  bench.sends = false;
  bench.run(0.1);
  EXPECT_TRUE(bench.report.contact) << "the observer goes on";
  EXPECT_FALSE(bench.report.force_measured) << "its F_e has another lag, so it is no substitute";
}

// Tries slave_io: it has not been tared
TEST(WristInput, ATareIsAskedForAtRestAndItsOutcomeIsShown) {
  WristInputBench bench("can");
  bool hinders = false;
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("no sensor at the wrist is in use"));
  bench.run(0.02);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("has not been tared"));
  EXPECT_TRUE(hinders);
  bench.speed_rad_s = 0.02;
  bench.tick();
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("the arm moves; allowed: at rest"));
  bench.speed_rad_s = 0.0;
  bench.observed = true;
  bench.tick();
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("touched"));
  bench.observed = false;
  bench.force_W_N = {0, 0, 21};
  bench.tick();
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("allowed: up to tare.most_N"));
  bench.force_W_N = {0, 0, 15};
  bench.tick();
  EXPECT_TRUE(bench.inbox.tare.ask());
  bench.run(0.1);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("is being tared"));
  EXPECT_FALSE(hinders);
  EXPECT_THAT(bench.inbox.tare.ask().message(), HasSubstr("already"));
  bench.run(0.4);
  EXPECT_EQ(wrist_sentence(bench.report.wrist, hinders), "");
  EXPECT_NEAR(bench.report.wrist.offset_N, 15.0, 0.02);
  EXPECT_TRUE(bench.inbox.tare.ask());
  bench.run(0.1);
  bench.speed_rad_s = 0.02;
  bench.run(0.1);
  EXPECT_THAT(wrist_sentence(bench.report.wrist, hinders), HasSubstr("tare has failed: the arm moved"));
  EXPECT_TRUE(bench.report.force_measured) << "the offset of before stays";
}

TEST_P(WristInputBy, ATickTakesNoHeap) {
  WristInputBench bench(GetParam());
  bench.tare();
  for (int i = 0; i < 50; ++i) {
    bench.now_ns += kSensorPeriod_ns;
    bench.send(shown_at_home(bench.config, {0, 0, 30}));
    if (bench.sensor) bench.local.advance_to(bench.now_ns);
    const test::HeapGuard guard;
    bench.input->step(bench.report, 0.002, bench.now_ns);
  }
  EXPECT_TRUE(bench.report.contact);
}

// In the whole servo, with the drives: F_e is the sensor's, and the observer adds its contact.
TEST(WristInput, TheServoReportsWhatTheSensorSays) {
  Config config = can_config();
  config.wrist = wrist_config("source: can", "source: topic");
  ArmBench bench(config);
  WristInput input(shipped_arm(), *config.wrist, bench.inbox);
  bench.servo = std::make_unique<Servo>(shipped_arm(), bench.config, *bench.arm, bench.inbox, 1, bench.stops,
                                        nullptr, &input);
  Vector3d force_W_N = Vector3d::Zero();
  ReceivedWrench wrench;
  wrench.valid = true;
  const auto run = [&](double duration_s) {
    for (double t = 0; t < duration_s; t += bench.config.period_s) {
      const teleop::Wrench w = shown_at_home(*config.wrist, force_W_N);
      wrench.force_N = messages::vector_of(w.force_N);
      wrench.torque_Nm = messages::vector_of(w.torque_Nm);
      wrench.received_ns = bench.now_ns;
      bench.inbox.wrist.write(wrench);
      bench.tick();
    }
  };
  for (int i = 0; i < 50 && bench.state() != teleop::LinkState::kCoupled; ++i) run(0.1);
  ASSERT_EQ(bench.state(), teleop::LinkState::kCoupled);
  EXPECT_FALSE(bench.last.force_measured) << "not tared, and the observer is no substitute";
  ASSERT_TRUE(bench.inbox.tare.ask()) << bench.inbox.tare.ask().message();
  run(0.5);
  EXPECT_TRUE(bench.last.force_measured);
  EXPECT_FALSE(bench.last.contact);
  force_W_N = {0, 0, 40};
  run(0.1);
  EXPECT_TRUE(bench.last.contact);
  EXPECT_NEAR(bench.last.contact_force_N, 40.0, 1.0);
  EXPECT_GT(std::abs(bench.last.external_torque_Nm[2]), 2.0);
}

}  // namespace
}  // namespace phantom::slave_io
