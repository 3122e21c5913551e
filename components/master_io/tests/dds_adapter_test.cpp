#include "components/master_io/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/dds/source_guard.hpp"
#include "components/master_io/dds_adapter_convert.hpp"
#include "components/master_io/tests/fixture.hpp"

namespace phantom::master_io {
namespace {

using testing::HasSubstr;
constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                           -std::numeric_limits<double>::infinity()};

Expectations expected(teleop::DragMode mode = teleop::DragMode::kSeparable) {
  Expectations e;
  e.joint_count = 7;
  e.lower.fill(-1);
  e.upper.fill(1);
  e.drag_mode = mode;
  return e;
}

msg::SlaveState good_slave() {
  msg::SlaveState slave;
  slave.stamp().sequence_number(3);
  slave.stamp().session(8);
  slave.joint_count(7);
  slave.state(msg::LINK_ALIGNED);
  return slave;
}

msg::DragField good_field() {
  msg::DragField field;
  field.stamp().sequence_number(3);
  field.joint_count(7);
  field.valid(true);
  return field;
}

TEST(MasterAdapter, AValidSlaveStateComesThroughWhole) {
  auto slave = good_slave();
  slave.position_rad()[1] = 0.5;
  slave.loop_torque_Nm()[2] = -6;
  slave.velocity_rad_s()[4] = 0.7;
  slave.external_torque_measured(true);
  slave.external_torque_Nm()[5] = 1.5;
  slave.contact(true);
  slave.contact_object(4);
  slave.tool_speed_m_s(0.3);
  slave.clearance_m(0.02);
  ASSERT_EQ(refusal(slave, expected()), nullptr);
  const auto sample = to_sample(slave, 77, 8);
  EXPECT_EQ(sample.received_ns, 77);
  EXPECT_EQ(sample.state, teleop::LinkState::kAligned);
  EXPECT_EQ(sample.motion.position[1], 0.5);
  EXPECT_EQ(sample.effort.loop_torque_Nm[2], -6);
  EXPECT_EQ(sample.motion.velocity[4], 0.7);
  EXPECT_EQ(sample.effort.external_torque_Nm[5], 1.5);
  EXPECT_TRUE(sample.force_measured);
  EXPECT_TRUE(sample.contact);
  EXPECT_EQ(sample.contact_object, 4);
  EXPECT_EQ(sample.tool_speed_m_s, 0.3);
  EXPECT_EQ(sample.clearance_m, 0.02);
  EXPECT_EQ(sample.stamp.session, 8U);
}

TEST(MasterAdapter, SlaveStatesThatCannotBeTrueAreRefused) {
  for (const double bad : kBad) {
    auto slave = good_slave();
    slave.position_rad()[6] = bad;
    EXPECT_THAT(refusal(slave, expected()), HasSubstr("position"));
    slave = good_slave();
    slave.loop_torque_Nm()[0] = bad;
    EXPECT_THAT(refusal(slave, expected()), HasSubstr("loop torque"));
    slave = good_slave();
    slave.velocity_rad_s()[3] = bad;
    EXPECT_THAT(refusal(slave, expected()), HasSubstr("velocity"));
    slave = good_slave();
    slave.external_torque_Nm()[2] = bad;
    EXPECT_THAT(refusal(slave, expected()), HasSubstr("external torque"));
    slave = good_slave();
    slave.tool_speed_m_s(bad);
    EXPECT_NE(refusal(slave, expected()), nullptr);
  }
  auto slave = good_slave();
  slave.joint_count(6);
  EXPECT_THAT(refusal(slave, expected()), HasSubstr("joint count"));
  slave = good_slave();
  slave.position_rad()[0] = 1.09;
  EXPECT_EQ(refusal(slave, expected()), nullptr) << "5 % of the range beyond the limit is allowed";
  slave.position_rad()[0] = 1.11;
  EXPECT_THAT(refusal(slave, expected()), HasSubstr("limits"));
  slave = good_slave();
  slave.state(static_cast<msg::LinkState>(9));
  EXPECT_THAT(refusal(slave, expected()), HasSubstr("state"));
  slave = good_slave();
  slave.stamp().sequence_number(0);
  EXPECT_THAT(refusal(slave, expected()), HasSubstr("sequence number"));
}

TEST(MasterAdapter, DragFieldsThatCannotBeTrueAreRefused) {
  for (const double bad : {kBad[0], kBad[1], -0.1}) {
    auto field = good_field();
    field.coefficient_plus()[2] = bad;
    EXPECT_THAT(refusal(field, expected()), HasSubstr("coefficient"));
    field = good_field();
    field.coefficient_minus()[6] = bad;
    EXPECT_THAT(refusal(field, expected()), HasSubstr("coefficient"));
  }
  auto field = good_field();
  field.coupled()[27] = kBad[0];
  EXPECT_EQ(refusal(field, expected()), nullptr) << "not used in this mode";
  field.mode(msg::DRAG_COUPLED);
  EXPECT_THAT(refusal(field, expected(teleop::DragMode::kCoupled)), HasSubstr("matrix"));
  field.coupled()[27] = -0.1;  // off the diagonal anything may be
  EXPECT_EQ(refusal(field, expected(teleop::DragMode::kCoupled)), nullptr);
  field.joint_count(8);
  EXPECT_THAT(refusal(field, expected()), HasSubstr("joint count"));
}

TEST(MasterAdapter, ReorderedSamplesAndThoseOfASecondPhantomAreRefused) {
  dds::SourceGuard source;
  auto field = good_field();
  EXPECT_EQ(dds::reason(source.assess(field.stamp(), 1000)), nullptr);
  field.stamp().sequence_number(2);
  EXPECT_THAT(dds::reason(source.assess(field.stamp(), 2000)), HasSubstr("older"));
  field.stamp().session(77);
  EXPECT_THAT(dds::reason(source.assess(field.stamp(), 3000)), HasSubstr("another process"));
}

TEST(MasterAdapter, ASlaveThatFollowsAnotherMasterIsToldFromOneThatFollowsNobodyYet) {
  auto slave = good_slave();
  EXPECT_FALSE(to_sample(slave, 77, 8).answers_another);
  slave.master_echo().session(8);
  EXPECT_FALSE(to_sample(slave, 77, 8).answers_another);
  slave.master_echo().session(9);
  EXPECT_TRUE(to_sample(slave, 77, 8).answers_another);
}

TEST(MasterAdapter, RoundTripsCountOwnStampsOnceEach) {
  RoundTrip trip(42);
  auto field = good_field();
  EXPECT_EQ(trip.measure(field, 10), -1.0) << "no echo yet";
  field.master_echo().session(42);
  field.master_echo().sequence_number(5);
  field.master_echo().monotonic_ns(1'000'000);
  EXPECT_NEAR(trip.measure(field, 3'000'000), 0.002, 1e-12);
  EXPECT_EQ(trip.measure(field, 4'000'000), -1.0) << "counted before";
  field.master_echo().sequence_number(6);
  field.master_echo().session(43);
  EXPECT_EQ(trip.measure(field, 4'000'000), -1.0) << "another process's";
}

TEST(MasterAdapter, AnEchoOfATimeThatCannotBeIsNone) {
  RoundTrip trip(42);
  auto field = good_field();
  auto slave = good_slave();
  for (msg::Echo* echo : {&field.master_echo(), &slave.master_echo()}) {
    echo->session(42);
    echo->sequence_number(5);
  }
  for (const core::Nanoseconds odd_ns :
       {std::numeric_limits<core::Nanoseconds>::min(), core::Nanoseconds{-1}, core::Nanoseconds{1001},
        std::numeric_limits<core::Nanoseconds>::max()}) {
    field.master_echo().monotonic_ns(odd_ns);
    slave.master_echo().monotonic_ns(odd_ns);
    EXPECT_EQ(trip.measure(field, 1000), -1.0);
    EXPECT_EQ(to_sample(field, 1000, 42).answers_ns, 0);
    EXPECT_EQ(to_sample(slave, 1000, 42).answers_ns, 0);
  }
  field.master_echo().monotonic_ns(400);
  slave.master_echo().monotonic_ns(400);
  EXPECT_NEAR(trip.measure(field, 1000), 6e-7, 1e-15);
  EXPECT_EQ(to_sample(field, 1000, 42).answers_ns, 400);
  EXPECT_EQ(to_sample(slave, 1000, 42).answers_ns, 400);
}

TEST(MasterAdapter, CommandsAreTakenWithinTheirRanges) {
  Settings settings;
  settings.percept_gain = teleop::everywhere(3);
  const GainRules rules = gain_rules(shipped_config(), shipped_arm().arm);
  msg::OperatorCommand command;
  command.stamp().sequence_number(1);
  command.joint(kAllJoints);
  const auto give = [&](msg::CommandKind kind, double value) {
    command.kind(kind);
    command.value(value);
    return take_setting(command, rules, 0.004, settings).is_ok();
  };
  EXPECT_TRUE(give(msg::COMMAND_SET_PERCEPT_GAIN, 7));
  EXPECT_EQ(settings.percept_gain, teleop::everywhere(7));
  for (const double bad : {kBad[0], kBad[1], -1.0, 1001.0})
    EXPECT_FALSE(give(msg::COMMAND_SET_PERCEPT_GAIN, bad));
  EXPECT_EQ(settings.percept_gain, teleop::everywhere(7));
  EXPECT_TRUE(give(msg::COMMAND_SET_FEEDBACK_GAIN, 0.012));
  EXPECT_FALSE(give(msg::COMMAND_SET_FEEDBACK_GAIN, 11));
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(0.012));
  EXPECT_TRUE(give(msg::COMMAND_ENABLE_PERCEPT, 0));
  EXPECT_FALSE(give(msg::COMMAND_ENABLE_PERCEPT, 0.5));
  EXPECT_FALSE(settings.percept_enabled);
  EXPECT_TRUE(give(msg::COMMAND_SET_LAW, 3));
  EXPECT_EQ(settings.law, teleop::BilateralLaw::kPe);
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(teleop::kLawsOwnGain))
      << "one law's gain is not another's";
  for (const double bad : {kBad[0], kBad[1], -1.0, 5.0, 1.5}) EXPECT_FALSE(give(msg::COMMAND_SET_LAW, bad));
  EXPECT_FALSE(give(static_cast<msg::CommandKind>(50), 0));
}

// 1/A = 10 from the page swung all joints at 57 Hz, 0.1 two of them.
TEST(MasterAdapter, AGainThatIsNotStableIsRefusedWithTheGreatestThatIs) {
  Settings settings;
  const GainRules rules = gain_rules(shipped_config(), shipped_arm().arm);
  msg::OperatorCommand command;
  command.stamp().sequence_number(1);
  command.kind(msg::COMMAND_SET_FEEDBACK_GAIN);
  const auto give = [&](double value, int joint, double delay_s) {
    command.value(value);
    command.joint(joint);
    return take_setting(command, rules, delay_s, settings).message();
  };
  EXPECT_THAT(give(10, kAllJoints, 0.004),
              testing::MatchesRegex("1/A 10 is not stable on j3_shoulder with law sctfb and 4 ms delay; "
                                    "allowed: up to 0\\.01[0-9]*"));
  EXPECT_THAT(give(0.1, kAllJoints, 0.004), HasSubstr("j3_shoulder"));
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(teleop::kLawsOwnGain)) << "nothing was changed";
  EXPECT_EQ(give(0.1, 6, 0.004), "") << "the tool's roll bears it";
  EXPECT_EQ(settings.feedback_gain[6], 0.1);
  EXPECT_EQ(settings.feedback_gain[2], teleop::kLawsOwnGain);
  EXPECT_THAT(give(0.1, 6, 0.02), HasSubstr("j7_tool_roll with law sctfb and 20 ms delay"));
  EXPECT_THAT(give(0.01, 7, 0.004), HasSubstr("allowed: 0 to 6, or -1 for all"));
  EXPECT_THAT(give(0.01, -2, 0.004), HasSubstr("no joint -2"));
  command.kind(msg::COMMAND_SET_PERCEPT_GAIN);
  EXPECT_EQ(give(5, 3, 0.004), "");
  EXPECT_EQ(settings.percept_gain[3], 5);
  EXPECT_EQ(settings.percept_gain[2], 0);
  EXPECT_THAT(give(5, 7, 0.004), HasSubstr("no joint 7"));
}

TEST(MasterAdapter, ADragFieldOfAnotherLawIsRefused) {
  auto field = good_field();
  field.mode(msg::DRAG_COUPLED);
  EXPECT_THAT(refusal(field, expected()), HasSubstr("not separable, which this master renders"));
  EXPECT_EQ(refusal(field, expected(teleop::DragMode::kCoupled)), nullptr);
  field.mode(msg::DRAG_SEPARABLE);
  EXPECT_THAT(refusal(field, expected(teleop::DragMode::kCoupled)), HasSubstr("not coupled"));
  EXPECT_EQ(refusal(field, expected()), nullptr);
  EXPECT_EQ(static_cast<int>(teleop::DragMode::kCoupled), static_cast<int>(msg::DRAG_COUPLED));
}

TEST(MasterAdapter, ThePhantomsContactIsItsWorstSensorAtASurface) {
  msg::Percept percept;
  percept.valid(true);
  percept.closeness(0.99);
  EXPECT_FALSE(to_sample(percept, 5).contact);
  percept.closeness(1.0);
  EXPECT_TRUE(to_sample(percept, 5).contact);
  percept.valid(false);
  EXPECT_FALSE(to_sample(percept, 5).contact);
}

TEST(MasterAdapter, TheReportBecomesAMessageFieldByField) {
  MasterReport report;
  report.outputs.state = teleop::LinkState::kCoupled;
  report.outputs.stop = {44, teleop::StopCause::kEmergency};
  report.outputs.percept_Nm[0] = -1;
  report.outputs.feedback_Nm[1] = 2;
  report.outputs.percept_gain = 11;
  report.outputs.feedback_gain = 0.05;
  report.outputs.percept_enabled = true;
  report.outputs.damping_limited = true;
  report.outputs.law = teleop::BilateralLaw::kPfff;
  report.outputs.feedback_damped = report.outputs.force_missing = report.outputs.feedback_limited = true;
  report.position[2] = 0.3;
  report.velocity[3] = 0.4;
  report.operator_Nm[4] = 0.5;
  report.reach = 6;
  report.slave = {1, 2, 3};
  report.drag = {4, 5, 6};
  report.round_trip_s = 0.001;
  const auto master = to_message(report, 7);
  EXPECT_EQ(master.state(), msg::LINK_COUPLED);
  EXPECT_EQ(master.stop_cause(), msg::STOP_EMERGENCY);
  EXPECT_EQ(master.stop(), 44U);
  EXPECT_EQ(master.law(), msg::LAW_PFFF);
  EXPECT_TRUE(master.feedback_damped());
  EXPECT_TRUE(master.feedback_limited());
  EXPECT_TRUE(master.force_missing());
  EXPECT_EQ(master.joint_count(), 7U);
  EXPECT_EQ(master.percept_torque_Nm()[0], -1);
  EXPECT_EQ(master.feedback_torque_Nm()[1], 2);
  EXPECT_EQ(master.position_rad()[2], 0.3);
  EXPECT_EQ(master.velocity_rad_s()[3], 0.4);
  EXPECT_EQ(master.operator_torque_Nm()[4], 0.5);
  EXPECT_EQ(master.percept_gain(), 11);
  EXPECT_EQ(master.feedback_gain(), 0.05);
  EXPECT_TRUE(master.percept_enabled());
  EXPECT_TRUE(master.percept_limited());
  EXPECT_EQ(master.reach(), 6);
  EXPECT_EQ(master.slave_echo().sequence_number(), 1U);
  EXPECT_EQ(master.drag_echo().session(), 6U);
  EXPECT_EQ(master.round_trip_s(), 0.001);
}

}  // namespace
}  // namespace phantom::master_io
