#include "common/teleop/guards/wrist_sensor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

using core::JointArray;
using Eigen::Vector3d;

constexpr double kSensorTick_s = 0.001;
const double kNoNumber = std::numeric_limits<double>::quiet_NaN();

const robot::SerialArm& wrist_arm() {
  static const robot::SerialArm made = robot::test_arms::suspended();
  return made;
}

WristSensorParameters wrist_parameters() {
  WristSensorParameters p;
  p.link = wrist_arm().joint_count();
  p.X_LS = {geometry::rotation_from_rpy(0.3, -0.7, 1.1), {0.02, -0.01, 0.05}};
  p.payload_kg = 1.7;
  p.payload_centre_m = {0.01, 0.03, 0.12};
  p.rated_N = {200.0, 200.0, 400.0};
  p.rated_Nm = {20.0, 20.0, 15.0};
  p.threshold_N = 2.0;
  p.threshold_Nm = 0.2;
  p.still.fill(0.01);
  return p;
}

/// The sensor on the arm, with the wrench that physics gives: a force of the surroundings at a point, the
/// payload's weight there, and an offset of the sensor's own.
class WristSensorBench {
 public:
  explicit WristSensorBench(WristSensorParameters with = wrist_parameters())
      : p(std::move(with)), sensor(wrist_arm(), p, tip_m), random_(5) {
    place(robot::test_arms::random_joints(wrist_arm(), random_));
  }

  void place(const JointArray& pose) { wrist_arm().link_poses(q = pose, X_WL); }
  void place_anywhere() { place(robot::test_arms::random_joints(wrist_arm(), random_)); }
  geometry::Pose X_WS() const { return X_WL[p.link] * p.X_LS; }

  /// What the sensor outputs: the reading by its own axes.
  Wrench reading() const {
    const Eigen::Matrix3d R_SW = X_WS().rotation.transpose();
    const Vector3d weight_W(0.0, 0.0, -9.80665 * p.payload_kg);
    const Vector3d centre_W = X_WS() * p.payload_centre_m - X_WS().translation_m;
    const Vector3d lever_W = X_WL[p.link] * touched_at_m - X_WS().translation_m;
    return {R_SW * (force_W_N + weight_W) + offset.force_N,
            R_SW * (lever_W.cross(force_W_N) + centre_W.cross(weight_W)) + offset.torque_Nm};
  }
  const WristForce& tick() {
    felt = sensor.step({reading(), valid, fresh, age_s}, X_WL, v, touched, kSensorTick_s);
    return felt;
  }
  const WristForce& run(double duration_s) {
    for (double t = 0.0; t < duration_s - 1e-9; t += kSensorTick_s) tick();
    return felt;
  }
  TareState tare() {
    sensor.tare();
    run(p.tare_s + 3 * kSensorTick_s);
    return felt.tare;
  }

  WristSensorParameters p;
  const Vector3d tip_m{0.0, 0.02, 0.3};
  WristSensor sensor;
  JointArray q{}, v{};
  robot::LinkPoses X_WL;
  Vector3d force_W_N = Vector3d::Zero(), touched_at_m{0.03, 0.01, 0.25};  // in the link's frame
  Wrench offset{{3.0, -4.0, 2.0}, {0.3, 0.2, -0.1}};
  bool valid = true, fresh = true, touched = false;
  double age_s = 0.0;
  WristForce felt;

 private:
  std::mt19937 random_;
};

WristSensorBench tared(WristSensorParameters with = wrist_parameters()) {
  WristSensorBench bench(std::move(with));
  bench.run(0.01);
  EXPECT_EQ(bench.tare(), TareState::kDone);
  bench.run(0.1);
  EXPECT_TRUE(bench.felt.measured());
  return bench;
}

// The oracle is virtual work: the force's work on its point, by finite differences of the arm's kinematics.
TEST(WristSensor, ForceOnThePayloadDoesTheSameWorkOnTheJoints) {
  auto p = wrist_parameters();
  p.threshold_N = p.threshold_Nm = 1e-9;
  p.needs_tare = false;
  WristSensorBench bench(p);
  bench.offset = {};
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 50; ++trial) {
    bench.place_anywhere();
    bench.force_W_N = 20.0 * Vector3d(normal(random), normal(random), normal(random));
    bench.run(0.06);
    ASSERT_TRUE(bench.felt.measured());
    for (std::size_t j = 0; j < wrist_arm().joint_count(); ++j) {
      constexpr double kStep = 1e-6;
      robot::LinkPoses before, after;
      JointArray there = bench.q;
      there[j] -= kStep;
      wrist_arm().link_poses(there, before);
      there[j] += 2 * kStep;
      wrist_arm().link_poses(there, after);
      const Vector3d moved_m =
          after[bench.p.link] * bench.touched_at_m - before[bench.p.link] * bench.touched_at_m;
      EXPECT_NEAR(bench.felt.torque_Nm[j], bench.force_W_N.dot(moved_m) / (2 * kStep), 1e-5) << j;
    }
    for (std::size_t j = wrist_arm().joint_count(); j < core::kMaxJoints; ++j)
      EXPECT_EQ(bench.felt.torque_Nm[j], 0.0);
  }
}

TEST(WristSensor, OffsetAndPayloadAreGoneInEveryPoseAfterATareInOne) {
  WristSensorBench bench = tared();
  EXPECT_NEAR(bench.felt.offset_N, std::sqrt(9.0 + 16.0 + 4.0), 1e-9);
  EXPECT_NEAR(bench.felt.offset_Nm, std::sqrt(0.09 + 0.04 + 0.01), 1e-9);
  for (int trial = 0; trial < 50; ++trial) {
    bench.place_anywhere();
    bench.run(0.002);
    EXPECT_TRUE(bench.felt.measured());
    EXPECT_FALSE(bench.felt.contact);
    EXPECT_LT(bench.felt.force_N, 1e-9);
    EXPECT_EQ(bench.felt.torque_Nm, JointArray{});
  }
}

TEST(WristSensor, APayloadThatIsNotTheConfiguredOneIsFelt) {
  WristSensorBench bench = tared();
  bench.p.payload_kg = 0.5;  // it has lost the greater part of its payload
  bench.run(0.1);
  EXPECT_TRUE(bench.felt.contact);
  EXPECT_NEAR(bench.felt.force_N, 1.2 * 9.80665, 1e-6);
}

TEST(WristSensor, TheLineOfActionGoesThroughThePointThatIsTouched) {
  WristSensorBench bench = tared();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 50; ++trial) {
    bench.place_anywhere();
    bench.force_W_N = Vector3d(normal(random), normal(random), normal(random)).normalized() * 30.0;
    bench.touched_at_m = 0.1 * Vector3d(normal(random), normal(random), normal(random));
    bench.run(0.01);
    ASSERT_TRUE(bench.felt.contact && bench.felt.has_line);
    EXPECT_NEAR(bench.felt.force_N, 30.0, 1e-9);
    const Vector3d found(bench.felt.on_line_W_m.data()), along = bench.force_W_N / 30.0;
    EXPECT_LT(along.cross(bench.X_WL[bench.p.link] * bench.touched_at_m - found).norm(), 1e-9);
    EXPECT_NEAR(along.dot(bench.X_WL[bench.p.link] * bench.tip_m - found), 0.0, 1e-9) << "nearest to the tip";
  }
}

TEST(WristSensor, ATorqueHasNoLineOfAction) {
  WristSensorBench bench = tared();
  bench.offset.torque_Nm += Vector3d(0.0, 10.0, 0.0);
  bench.run(0.1);
  EXPECT_TRUE(bench.felt.contact);
  EXPECT_FALSE(bench.felt.has_line);
  bench.offset.force_N += Vector3d(2.5, 0.0, 0.0);  // 4 m away
  bench.run(0.1);
  EXPECT_FALSE(bench.felt.has_line);
}

TEST(WristSensor, BelowTheThresholdNothingIsFeltAndBeyondItGrowsFromZeroNeverSteeper) {
  WristSensorBench bench = tared();
  bench.touched_at_m = bench.p.X_LS.translation_m;  // at S: a force alone
  const Vector3d along = Vector3d(1.0, -2.0, 0.5).normalized();
  JointArray before{};
  double before_N = 0.0;
  for (double force_N = 0.0; force_N < 20.0; force_N += 0.03) {
    bench.force_W_N = force_N * along;
    bench.tick();
    JointArray all{};
    wrist_arm().add_force(bench.p.link, bench.X_WS().translation_m, along, bench.X_WL, all);
    for (std::size_t j = 0; j < wrist_arm().joint_count(); ++j) {
      EXPECT_NEAR(bench.felt.torque_Nm[j], all[j] * std::max(0.0, force_N - bench.p.threshold_N), 1e-9);
      EXPECT_LE(std::abs(bench.felt.torque_Nm[j] - before[j]),
                std::abs(all[j]) * (force_N - before_N) + 1e-12);
    }
    EXPECT_EQ(bench.felt.contact, force_N > bench.p.threshold_N + 1e-9) << force_N;
    before = bench.felt.torque_Nm;
    before_N = force_N;
  }
  bench.force_W_N = 1.9 * along;  // not below 0.8 of it
  EXPECT_TRUE(bench.run(1.0).contact);
  bench.force_W_N = 1.5 * along;
  EXPECT_TRUE(bench.run(0.04).contact);
  EXPECT_FALSE(bench.run(0.02).contact);
}

TEST(WristSensor, TheFilterIsALowPassOfTheStatedTime) {
  auto p = wrist_parameters();
  p.filter_s = 0.02;
  p.threshold_N = p.threshold_Nm = 1e-6;
  p.needs_tare = false;
  WristSensorBench bench(p);
  bench.offset = {};
  bench.run(0.1);
  bench.force_W_N = {0.0, 0.0, -50.0};
  double share = 0.0;
  for (int i = 0; i < 100; ++i) {
    bench.fresh = i % 4 == 0;  // a slower sensor: its samples are 4 ms apart
    if (bench.fresh) share += 0.004 / (0.004 + 0.02) * (1.0 - share);
    if (i == 0) share = 0.001 / 0.021;
    EXPECT_NEAR(bench.tick().force_N, 50.0 * share, 1e-4) << i;
  }
}

struct SensorFailure {
  const char* name;
  WristState state;
  void (*begin)(WristSensorBench&);
};

// Tries slave_io: is beyond its rated range
TEST(WristSensor, SR11_WhatCannotBeBelievedIsNotMeasuredAtOnceAndAfterwardsOnlyWhenItHasBeenGood) {
  const SensorFailure failures[] = {
      {"stale", WristState::kStale, [](WristSensorBench& b) { b.age_s = 0.0201; }},
      {"never", WristState::kSilent,
       [](WristSensorBench& b) { b.age_s = std::numeric_limits<double>::infinity(); }},
      {"no time", WristState::kSilent, [](WristSensorBench& b) { b.age_s = kNoNumber; }},
      {"invalid", WristState::kInvalid, [](WristSensorBench& b) { b.valid = false; }},
      {"nan", WristState::kInvalid, [](WristSensorBench& b) { b.offset.force_N.y() = kNoNumber; }},
      {"inf", WristState::kInvalid, [](WristSensorBench& b) { b.offset.torque_Nm.z() = HUGE_VAL; }},
      {"force", WristState::kSaturated, [](WristSensorBench& b) { b.offset.force_N.x() = -300.0; }},
      {"torque", WristState::kSaturated, [](WristSensorBench& b) { b.offset.torque_Nm.z() = 60.0; }},
  };
  for (const SensorFailure& failure : failures) {
    WristSensorBench bench = tared();
    bench.force_W_N = {0.0, 30.0, 0.0};
    bench.run(0.01);
    ASSERT_TRUE(bench.felt.measured() && bench.felt.contact) << failure.name;
    const Wrench sound = bench.offset;
    failure.begin(bench);
    const auto nothing = [&] {
      return !bench.felt.measured() && !bench.felt.contact && bench.felt.torque_Nm == JointArray{} &&
             bench.felt.force_N == -1.0 && !bench.felt.has_line;
    };
    for (int i = 0; i < 100; ++i) {
      bench.tick();
      ASSERT_TRUE(nothing()) << failure.name << i;
      EXPECT_EQ(bench.felt.state, failure.state) << failure.name;
    }
    bench.offset = sound;
    bench.valid = true;
    bench.age_s = 0.0;
    for (double t = kSensorTick_s; t < WristSensor::kRecovery_s - 1e-9; t += kSensorTick_s) {
      bench.tick();
      ASSERT_TRUE(nothing()) << failure.name;
      EXPECT_EQ(bench.felt.state, WristState::kSettling) << failure.name;
    }
    bench.run(0.002);
    EXPECT_TRUE(bench.felt.measured() && bench.felt.contact) << failure.name;
    EXPECT_NEAR(bench.felt.force_N, 30.0, 1e-9) << failure.name;
  }
}

TEST(WristSensor, BeforeTheFirstTareNothingIsMeasuredUnlessItIsNotNeeded) {
  WristSensorBench bench;
  bench.run(1.0);
  EXPECT_EQ(bench.felt.state, WristState::kNotTared);
  auto p = wrist_parameters();
  p.needs_tare = false;
  WristSensorBench without(p);
  without.offset = {};
  without.run(1.0);
  EXPECT_TRUE(without.felt.measured());
  EXPECT_LT(without.felt.force_N, 1e-9);
}

TEST(WristSensor, ATareAveragesOverItsTime) {
  WristSensorBench bench;
  bench.run(0.01);
  bench.sensor.tare();
  bench.tick();
  const Wrench mean = bench.offset;
  int ticks = 0;
  for (; bench.felt.tare == TareState::kRuns; ++ticks) {
    bench.offset.force_N.x() = mean.force_N.x() + (ticks % 2 == 0 ? 0.5 : -0.5);
    bench.tick();
    const bool runs = bench.felt.tare == TareState::kRuns;
    EXPECT_EQ(bench.felt.state, runs ? WristState::kTaring : WristState::kSettling);
  }
  EXPECT_EQ(bench.felt.tare, TareState::kDone);
  EXPECT_NEAR(ticks * kSensorTick_s, bench.p.tare_s, 2 * kSensorTick_s);
  bench.offset = mean;
  bench.run(0.1);
  EXPECT_LT(bench.felt.force_N, 0.5 / (ticks - 1));
}

TEST(WristSensor, ATareIsRefusedAndEndedWhileTheArmMovesOrIsTouchedAndLeavesTheOffset) {
  struct Case {
    TareRefusal refusal;
    TareState ended;
    void (*begin)(WristSensorBench&);
  };
  const Case cases[] = {
      {TareRefusal::kMoves, TareState::kMoved, [](WristSensorBench& b) { b.v[1] = -0.011; }},
      {TareRefusal::kMoves, TareState::kMoved, [](WristSensorBench& b) { b.v[0] = kNoNumber; }},
      {TareRefusal::kTouched, TareState::kTouched, [](WristSensorBench& b) { b.touched = true; }},
      {TareRefusal::kTouched, TareState::kTouched,
       [](WristSensorBench& b) {
         b.force_W_N = {0.0, 0.0, 40.0};
       }},
      {TareRefusal::kTouched, TareState::kTouched,
       [](WristSensorBench& b) { b.offset.torque_Nm.x() += 1.5; }},
      {TareRefusal::kNotMeasured, TareState::kLost, [](WristSensorBench& b) { b.valid = false; }},
      {TareRefusal::kNotMeasured, TareState::kLost, [](WristSensorBench& b) { b.age_s = 1.0; }},
  };
  for (const Case& c : cases) {
    WristSensorBench bench = tared();
    const WristSensorBench sound = bench;
    c.begin(bench);
    bench.tick();
    EXPECT_EQ(bench.felt.refusal, c.refusal);
    bench.sensor.tare();  // all the same
    bench.run(1.0);
    EXPECT_EQ(bench.felt.tare, c.ended);
    EXPECT_EQ(bench.felt.offset_N, sound.felt.offset_N);

    WristSensorBench again = tared();
    again.sensor.tare();
    again.run(0.2);
    EXPECT_EQ(again.felt.tare, TareState::kRuns);
    EXPECT_EQ(again.felt.refusal, TareRefusal::kRuns);
    c.begin(again);
    again.tick();
    EXPECT_EQ(again.felt.tare, c.ended);
    EXPECT_EQ(again.felt.offset_N, sound.felt.offset_N);
  }
}

TEST(WristSensor, AForceOrTorqueThatComesDuringATareEndsIt) {
  for (const bool force : {true, false}) {  // less than a tare takes away, more than the threshold
    WristSensorBench bench;
    bench.offset = {};
    bench.run(0.01);
    bench.sensor.tare();
    bench.run(0.2);
    (force ? bench.offset.force_N : bench.offset.torque_Nm).z() = force ? 2.5 : 0.25;
    EXPECT_EQ(bench.run(0.002).tare, TareState::kTouched);
  }
}

// Else a hand that leans on the tool could be tared away bit by bit.
TEST(WristSensor, TaresOneAfterTheOtherTakeAwayNoMoreThanOne) {
  WristSensorBench bench;
  bench.offset = {};
  bench.run(0.01);
  for (double force_N = 0.0; force_N < 40.0; force_N += 1.0) {
    bench.force_W_N = {0.0, force_N, 0.0};
    bench.tare();
    EXPECT_LE(bench.felt.offset_N, bench.p.most_offset_N + 1e-9);
  }
  bench.run(0.1);
  EXPECT_GT(bench.felt.force_N, 39.0 - bench.p.most_offset_N - 1e-9);
}

TEST(WristSensor, AStepTakesNoHeap) {
  WristSensorBench bench = tared();
  bench.force_W_N = {0.0, 30.0, 0.0};
  bench.tick();
  {
    const test::HeapGuard guard;
    bench.sensor.tare();
    bench.run(1.0);
  }
  EXPECT_TRUE(bench.felt.measured());
}

}  // namespace
}  // namespace phantom::teleop
