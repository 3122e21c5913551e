#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <sstream>
#include <thread>

#include "common/dds/tests/test_network.hpp"
#include "components/master_io/jnd/command.hpp"
#include "components/master_io/jnd/dds_adapter_gain.hpp"
#include "components/master_io/jnd/judges.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"

namespace phantom::master_io {
namespace {

using testing::HasSubstr;
constexpr std::size_t kJndJoint = 2;  // j3_shoulder
constexpr double kJndPeriod_s = 0.001, kEvenFluid = 0.02;

Config to_and_fro(double gain) {
  Config config = shipped_config();
  config.percept_gain = teleop::everywhere(gain);
  config.script.percept = simulation::PerceptSchedule::kOn;
  return config;
}

/// The simulated master and its operator, who reaches to and fro in an even fluid, in the test's own time.
class ComparedSimulatedMaster : public ComparedDrag, public ServoRig {
 public:
  explicit ComparedSimulatedMaster(double gain, double fluid = kEvenFluid)
      : config_(to_and_fro(gain)),
        device_(config_, shipped_arm().home),
        servo_(config_, shipped_arm().home, device_, inbox, 1, stops),
        settings_(initial_settings(config_)) {
    slave.position = shipped_arm().home;
    drag.drag.plus.fill(fluid);
    drag.drag.minus.fill(fluid);
  }

  core::Status set_gain(double gain) override {
    settings_.percept_gain[kJndJoint] = gain;
    inbox.settings.write(settings_);
    return core::Status::ok();
  }
  core::Expected<messages::Received<messages::MasterState>> next() override {
    now_ns += core::from_seconds(kJndPeriod_s);
    slave.position = last.outputs.state == teleop::LinkState::kInit ? shipped_arm().home : last.position;
    renew(slave);
    renew(drag);
    if (heard) inbox.slave.write(slave);
    inbox.drag.write(drag);
    tick(servo_, kJndPeriod_s);
    return messages::Received<messages::MasterState>(last, now_ns);
  }
  double gain() const { return settings_.percept_gain[kJndJoint]; }

 private:
  Config config_;
  SimulatedDevice device_;
  Servo servo_;
  Settings settings_;
};

JndPlan shoulder_plan(std::uint32_t seed = 1) {
  JndPlan plan;
  plan.staircase.seed = seed;
  plan.interval = {.joint = kJndJoint, .moving_s = 0.4};
  plan.joint_name = "j3_shoulder";
  plan.reference_gain = 20;
  plan.patience_s = 20;
  return plan;
}

SimulatedJudge judge_of(double fraction, std::uint32_t seed) {
  return SimulatedJudge({percept::ln_noise_of(fraction, percept::tracked_share(3), 0.02), 0.02, seed});
}

// The whole way: the staircase sets G, the servo renders, a simulated hand moves in the drag, and an observer
// of known threshold tells what it felt. The intervals of 95 % hold the truth in 8 of 8 runs but for one
// chance in 200 of two misses or more.
TEST(JndMeasurement, FindsTheThresholdOfASimulatedOperatorOnTheSimulatedMaster) {
  constexpr double kTruth = 0.25;
  int held = 0;
  double ln_error = 0.0;
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    ComparedSimulatedMaster master(20);
    SimulatedJudge judge = judge_of(kTruth, seed + 50);
    const auto outcome = measure_jnd(shoulder_plan(seed), master, judge);
    ASSERT_TRUE(outcome) << outcome.status().message();
    EXPECT_TRUE(outcome->settled);
    EXPECT_EQ(master.gain(), 20);
    EXPECT_NEAR(outcome->reference, 20 * kEvenFluid, 0.01 * 20 * kEvenFluid);
    for (const JndTrial& trial : outcome->trials) {
      const double ratio = std::max(trial.first, trial.second) / std::min(trial.first, trial.second);
      ASSERT_NEAR(ratio, 1.0 + trial.comparison.fraction, 0.01 * ratio) << "the hand felt another difference";
      ASSERT_EQ(trial.first > trial.second, trial.comparison.greater_first);
    }
    held += outcome->threshold.lower <= kTruth && kTruth <= outcome->threshold.upper ? 1 : 0;
    ln_error += std::log(outcome->threshold.fraction / kTruth) / 8;
  }
  EXPECT_GE(held, 7);
  EXPECT_LT(std::abs(ln_error), 0.25) << "mean of 8, each good to about 20 %";
}

// Tries master_io: `jnd`: drag that stability or a cap limits
TEST(JndMeasurement, DragThatStabilityOrACapLimitsIsNotTakenForG) {
  ComparedSimulatedMaster master(1000);
  SimulatedJudge judge = judge_of(0.25, 1);
  JndPlan plan = shoulder_plan();
  plan.reference_gain = 1000;
  const auto outcome = measure_jnd(plan, master, judge);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.status().message(), HasSubstr("was limited in 100 %"));
  EXPECT_THAT(outcome.status().message(), HasSubstr("allowed: a smaller --gain"));
  EXPECT_EQ(master.gain(), 1000) << "the reference again";
}

/// A master of which somebody else holds G at 20.
class DisturbedMaster : public ComparedSimulatedMaster {
 public:
  using ComparedSimulatedMaster::ComparedSimulatedMaster;
  core::Status set_gain(double) override { return ComparedSimulatedMaster::set_gain(20); }
};

// Tries master_io: somebody else sets G meanwhile
TEST(JndMeasurement, DragThatSomebodyElseSetsIsNotTakenForG) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {  // in both orders
    DisturbedMaster master(20);
    SimulatedJudge judge = judge_of(0.25, 1);
    const auto outcome = measure_jnd(shoulder_plan(seed), master, judge);
    ASSERT_FALSE(outcome);
    EXPECT_THAT(outcome.status().message(), HasSubstr("nobody else who sets G"));
  }
}

// Tries master_io: a hand that does not move
TEST(JndMeasurement, AHandThatDoesNotMoveEndsIt) {
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {  // some begin with the greater drag
    ComparedSimulatedMaster master(20);
    SimulatedJudge judge = judge_of(0.25, 1);
    JndPlan plan = shoulder_plan(seed);
    plan.interval.least_speed = 100;
    plan.patience_s = 3;
    const auto outcome = measure_jnd(plan, master, judge);
    ASSERT_FALSE(outcome);
    EXPECT_THAT(outcome.status().message(), HasSubstr("j3_shoulder moved for 0.0 s of 3 s"));
    EXPECT_EQ(master.gain(), 20) << "the reference again";
  }
}

TEST(JndMeasurement, MotionCountsOnlyWhileCoupled) {
  ComparedSimulatedMaster master(20);
  master.heard = false;
  SimulatedJudge judge = judge_of(0.25, 1);
  JndPlan plan = shoulder_plan();
  plan.patience_s = 3;
  const auto outcome = measure_jnd(plan, master, judge);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.status().message(), HasSubstr("moved for 0.0 s"));
}

// Tries master_io: no drag to compare
TEST(JndMeasurement, WithoutDragThereIsNothingToCompare) {
  ComparedSimulatedMaster master(20, 0.0);
  SimulatedJudge judge = judge_of(0.25, 1);
  const auto outcome = measure_jnd(shoulder_plan(), master, judge);
  ASSERT_FALSE(outcome);
  EXPECT_THAT(outcome.status().message(), HasSubstr("no drag on j3_shoulder"));
}

// Twice the time at half the weight of a sample would give another mean: it is weighted by time, not by
// count.
TEST(FeltDrag, IsTheDampingThatFitsBestWhateverTheSamplesAre) {
  FeltDrag felt({.joint = 0, .least_speed = 0.02, .moving_s = 0.5, .settle_s = 0.0});
  messages::Received<messages::MasterState> state;
  state.state = teleop::LinkState::kCoupled;
  state.percept_enabled = true;
  core::Nanoseconds now_ns = 1;
  const auto take = [&](double damping, double v, core::Nanoseconds step_ns) {
    state.received_ns = now_ns += step_ns;
    state.velocity[0] = v;
    state.percept_torque_Nm[0] = -damping * v;
    felt.take(state);
  };
  take(3, 0.1, 0);
  for (int i = 0; i < 100; ++i) take(2, 0.1, core::kNsPerMillisecond);
  for (int i = 0; i < 50; ++i) take(4, -0.1, 2 * core::kNsPerMillisecond);
  EXPECT_NEAR(felt.damping(), 3.0, 1e-9);
  EXPECT_NEAR(felt.moved_s(), 0.2, 1e-9);
  EXPECT_FALSE(felt.complete());
  take(50, 0.01, core::kNsPerMillisecond);  // at rest
  state.percept_enabled = false;
  take(50, 0.1, core::kNsPerMillisecond);  // drag off
  state.percept_enabled = true;
  state.state = teleop::LinkState::kReady;
  take(50, 0.1, core::kNsPerMillisecond);  // not coupled
  EXPECT_NEAR(felt.damping(), 3.0, 1e-9);
  EXPECT_NEAR(felt.moved_s(), 0.2, 1e-9);
}

/// A pipe's reading end with lines in it; the writing end is closed.
struct AnswerLines {
  explicit AnswerLines(const std::string& text) {
    EXPECT_EQ(pipe(ends), 0);
    EXPECT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
  }
  ~AnswerLines() { close(ends[0]); }
  int ends[2]{};
};

// Tries master_io: an operator who gives up
TEST(AskedPerson, IsAskedUntilTheAnswerIsOneOrTwoAndMayGiveUp) {
  AnswerLines lines("yes\n 2\n1\nq\n");
  std::ostringstream shown;
  AskedPerson person("j3_shoulder", lines.ends[0], shown);
  person.begin(7, 2);
  EXPECT_EQ(shown.str(), "trial 7, drag 2: move j3_shoulder to and fro, alike in both\n");
  const auto second = person.calls_first_greater(1, 2), first = person.calls_first_greater(1, 2);
  ASSERT_TRUE(second && first);
  EXPECT_FALSE(*second);
  EXPECT_TRUE(*first);
  EXPECT_EQ(person.calls_first_greater(1, 2).status().message(), "given up");
  EXPECT_EQ(person.calls_first_greater(1, 2).status().message(), "no more answers");
}

TEST(JndCommand, ItsPlanIsThatOfTheJointAndWrongArgumentsAreRefused) {
  const Config config = shipped_config();
  JndRequest request{.joint_name = "j3_shoulder"};
  const JndPlan plan = plan_of(request, shipped_arm(), config);
  EXPECT_EQ(plan.interval.joint, kJndJoint);
  EXPECT_EQ(plan.reference_gain, config.percept_gain[kJndJoint]);
  EXPECT_EQ(plan.unit, "N·m·s/rad");
  request.gain = 7;
  request.seed = 12;
  EXPECT_EQ(plan_of(request, shipped_arm(), config).reference_gain, 7);
  EXPECT_EQ(plan_of(request, shipped_arm(), config).staircase.seed, 12U);
  request.gain = 400;
  EXPECT_EQ(plan_of(request, shipped_arm(), config).staircase.greatest_fraction, 1.5)
      << "the greater drag has G 1000 at most";
  request.gain = 600;
  EXPECT_THROW(plan_of(request, shipped_arm(), config), core::ConfigError) << "the first one would have 1200";
  request = {.joint_name = "elbow"};
  EXPECT_THROW(plan_of(request, shipped_arm(), config), core::ConfigError);
  request = {};
  EXPECT_THROW(plan_of(request, shipped_arm(), config), core::ConfigError);
}

TEST(JndCommand, TellsWhatWasMeasuredAndWhatWasNot) {
  JndPlan plan = shoulder_plan();
  JndOutcome outcome;
  outcome.threshold = {0.213, 0.15, 0.3, 0.794, 0.2, 64, 12};
  outcome.settled = true;
  plan.unit = "N·m·s/rad";
  outcome.reference = 0.4;
  outcome.trials = {{{0.5, true}, 0.6, 0.4, true}};
  EXPECT_THAT(text_of(plan, outcome), HasSubstr("drag on j3_shoulder: 21.3 % (95 %: 15.0 to 30.0 %)"));
  EXPECT_THAT(text_of(plan, outcome), HasSubstr("reference: G 20, 0.4 N·m·s/rad"));
  EXPECT_THAT(text_of(plan, outcome), HasSubstr("wva_server --check --weber-fraction 0.213"));
  EXPECT_THAT(json_of(plan, outcome), HasSubstr("\"weber_fraction\": 0.213"));
  EXPECT_THAT(json_of(plan, outcome), HasSubstr("\"first_called_greater\": true"));
  outcome.settled = false;
  EXPECT_THAT(text_of(plan, outcome), HasSubstr("NOT SETTLED: 12 of 12"));
  EXPECT_THAT(text_of(plan, outcome), testing::Not(HasSubstr("wva_server")));
}

TEST(RunningDrag, SetsTheGainOfItsJointAloneAndHearsTheMaster) {
  const auto network = dds::test_network();
  const Config config = shipped_config();
  const messages::ArmBounds bounds = messages::bounds_of(shipped_arm().arm);
  Inbox inbox;
  DdsAdapter master(network, {bounds, config.percept.mode, gain_rules(config, shipped_arm().arm)},
                    initial_settings(config), inbox);
  RunningDrag drag(network, bounds, static_cast<int>(kJndJoint));
  ASSERT_TRUE(dds::eventually([&] { return drag.set_gain(12).is_ok(); }));
  Settings settings;
  inbox.settings.read(settings);
  core::JointArray wanted = config.percept_gain;
  wanted[kJndJoint] = 12;
  EXPECT_EQ(settings.percept_gain, wanted);
  EXPECT_THAT(drag.set_gain(5000).message(), HasSubstr("5000"));
  MasterReport report;
  report.joint_count = static_cast<std::uint32_t>(bounds.joint_count);
  report.position = shipped_arm().home;
  report.percept_torque_Nm[kJndJoint] = -0.5;
  std::atomic<bool> heard{false};
  std::thread publishing([&] {
    while (!heard) {
      master.publish(report);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  const auto state = drag.next();
  heard = true;
  publishing.join();
  ASSERT_TRUE(state) << state.status().message();
  EXPECT_EQ(state->percept_torque_Nm[kJndJoint], -0.5);
}

// Tries master_io: `jnd`: no master is heard
TEST(RunningDrag, ASilentMasterIsReported) {
  RunningDrag drag(dds::test_network(), messages::bounds_of(shipped_arm().arm), 0);
  const auto state = drag.next();
  ASSERT_FALSE(state);
  EXPECT_EQ(state.status().code(), core::ErrorCode::kUnavailable);
  EXPECT_THAT(state.status().message(), HasSubstr("no master_state"));
}

}  // namespace
}  // namespace phantom::master_io
