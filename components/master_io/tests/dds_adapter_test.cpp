#include "components/master_io/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <map>

#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "components/master_io/dds_adapter_convert.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "phantom_idl/percept.hpp"

namespace phantom::master_io {
namespace {

using teleop::CommandKind;
using testing::HasSubstr;
constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                           -std::numeric_limits<double>::infinity()};

// Tries master_io: out of order
TEST(MasterAdapter, ReorderedSamplesAndThoseOfASecondPhantomAreRefused) {
  dds::SourceGuard source;
  msg::DragField field;
  field.stamp().sequence_number(3);
  EXPECT_EQ(dds::reason(source.assess(field.stamp(), 1000)), nullptr);
  field.stamp().sequence_number(2);
  EXPECT_THAT(dds::reason(source.assess(field.stamp(), 2000)), HasSubstr("older"));
  field.stamp().session(77);
  EXPECT_THAT(dds::reason(source.assess(field.stamp(), 3000)), HasSubstr("another process"));
}

TEST(MasterAdapter, RoundTripsCountOwnStampsOnceEach) {
  RoundTrip trip(42);
  messages::DragField field;
  EXPECT_EQ(trip.measure(field, 10), -1.0) << "no echo yet";
  field.master_echo = {5, 1'000'000, 42};
  EXPECT_NEAR(trip.measure(field, 3'000'000), 0.002, 1e-12);
  EXPECT_EQ(trip.measure(field, 4'000'000), -1.0) << "counted before";
  field.master_echo.sequence_number = 6;
  field.master_echo.session = 43;
  EXPECT_EQ(trip.measure(field, 4'000'000), -1.0) << "another process's";
}

TEST(MasterAdapter, AnEchoOfATimeThatCannotBeIsNone) {
  RoundTrip trip(42);
  messages::DragField field;
  field.master_echo = {5, 0, 42};
  for (const core::Nanoseconds odd_ns :
       {std::numeric_limits<core::Nanoseconds>::min(), core::Nanoseconds{-1}, core::Nanoseconds{1001},
        std::numeric_limits<core::Nanoseconds>::max()}) {
    field.master_echo.monotonic_ns = odd_ns;
    EXPECT_EQ(trip.measure(field, 1000), -1.0);
    EXPECT_EQ(DragSample(field, field.master_echo, 1000, 42).answers_ns, 0);
  }
  field.master_echo.monotonic_ns = 400;
  EXPECT_NEAR(trip.measure(field, 1000), 6e-7, 1e-15);
  EXPECT_EQ(DragSample(field, field.master_echo, 1000, 42).answers_ns, 400);
}

TEST(MasterAdapter, CommandsAreTakenWithinTheirRanges) {
  Settings settings;
  settings.percept_gain = teleop::everywhere(3);
  const GainRules rules = gain_rules(shipped_config(), shipped_arm().arm);
  const auto give = [&](CommandKind kind, double value) {
    return apply_setting({.kind = kind, .value = value}, rules, 0.004, settings).is_ok();
  };
  EXPECT_TRUE(give(CommandKind::kSetPerceptGain, 7));
  EXPECT_EQ(settings.percept_gain, teleop::everywhere(7));
  for (const double bad : {kBad[0], kBad[1], -1.0, 1001.0})
    EXPECT_FALSE(give(CommandKind::kSetPerceptGain, bad));
  EXPECT_EQ(settings.percept_gain, teleop::everywhere(7));
  EXPECT_TRUE(give(CommandKind::kSetFeedbackGain, 0.012));
  EXPECT_FALSE(give(CommandKind::kSetFeedbackGain, 11));
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(0.012));
  EXPECT_TRUE(give(CommandKind::kEnablePercept, 0));
  EXPECT_FALSE(give(CommandKind::kEnablePercept, 0.5));
  EXPECT_FALSE(settings.percepts.drag);
  EXPECT_TRUE(give(CommandKind::kSetLaw, 3));
  EXPECT_EQ(settings.law, teleop::BilateralLaw::kPe);
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(teleop::kLawsOwnGain))
      << "one law's gain is not another's";
  for (const double bad : {kBad[0], kBad[1], -1.0, 5.0, 1.5}) EXPECT_FALSE(give(CommandKind::kSetLaw, bad));
  EXPECT_FALSE(give(static_cast<CommandKind>(50), 0));
}

// The columns of Table 6.1, and the choice that follows the law.
TEST(MasterAdapter, APersonChoosesDragToneAndViewsOrThoseOfTheLaw) {
  Config config = shipped_config();
  const GainRules rules = gain_rules(config, shipped_arm().arm);
  Settings settings = initial_settings(config);
  EXPECT_EQ(settings.percepts, teleop::PerceptChoice{}) << "all, and the law changes nothing";
  const auto give = [&](CommandKind kind, double value) {
    return apply_setting({.kind = kind, .value = value}, rules, 0.004, settings).is_ok();
  };
  const auto pe = static_cast<double>(teleop::BilateralLaw::kPe);
  for (int number = 0; number <= teleop::kAllPercepts; ++number) {
    ASSERT_TRUE(give(CommandKind::kSetPercepts, number));
    const teleop::PerceptChoice chosen{(number & 1) != 0, (number & 2) != 0, (number & 4) != 0, false};
    EXPECT_EQ(settings.percepts, chosen);
    ASSERT_TRUE(give(CommandKind::kSetLaw, pe));
    EXPECT_EQ(settings.percepts, chosen) << "a choice by hand stays whatever the law";
  }
  ASSERT_TRUE(give(CommandKind::kSetPercepts, teleop::kAutomaticPercepts));
  EXPECT_EQ(settings.percepts, (teleop::PerceptChoice{false, true, true, true}));
  ASSERT_TRUE(give(CommandKind::kSetLaw, 1));
  EXPECT_EQ(settings.percepts, (teleop::PerceptChoice{true, true, true, true}));
  const Settings before = settings;
  for (const double bad : {kBad[0], kBad[1], -1.0, 9.0, 2.5})
    EXPECT_FALSE(give(CommandKind::kSetPercepts, bad));
  EXPECT_FALSE(give(CommandKind::kCounterbalance, 1)) << "the slave's";
  EXPECT_EQ(settings.percepts, before.percepts);
  config.percepts = teleop::percepts_from_name("tone,views").value();
  EXPECT_EQ(initial_settings(config).percepts, (teleop::PerceptChoice{false, true, true, false}));
}

TEST(MasterAdapter, AKeyOfTheDeskSwitchesOnePerceptOrLeavesThemToTheLaw) {
  using enum PerceptKey;
  for (int number = 0; number <= teleop::kAllPercepts; ++number) {
    const auto now = teleop::percepts_of(number, teleop::BilateralLaw::kPe);
    for (const PerceptKey key : {kDrag, kTone, kViews}) {
      const int chosen = percepts_by_key(now, key);
      EXPECT_EQ(chosen ^ number, 1 << static_cast<int>(key));
      EXPECT_EQ(percepts_by_key(teleop::percepts_of(chosen, teleop::BilateralLaw::kPe), key), number);
    }
    EXPECT_EQ(percepts_by_key(now, kLaw), teleop::kAutomaticPercepts);
  }
  // From the law's own, which has no drag beside pe: the others stay as they are.
  const auto automatic = teleop::percepts_of(teleop::kAutomaticPercepts, teleop::BilateralLaw::kPe);
  EXPECT_EQ(percepts_by_key(automatic, kDrag), teleop::kAllPercepts);
}

TEST(MasterAdapter, WithSetLawANewLawSwitchesDragAsTable61HasIt) {
  using enum teleop::BilateralLaw;
  const std::map<teleop::BilateralLaw, bool> drag{
      {kPf, true}, {kSctfb, true}, {kPfff, true}, {kPe, false}, {kPeff, false}};
  Config config = shipped_config();
  for (const bool follows : {false, true}) {
    config.percepts = follows ? teleop::kAutomaticPercepts : teleop::kAllPercepts;
    const GainRules rules = gain_rules(config, shipped_arm().arm);
    for (const auto& [before, unused] : drag) {
      for (const auto& [law, stands_apart] : drag) {
        config.feedback.law = before;
        Settings settings = initial_settings(config);
        EXPECT_EQ(settings.percepts.drag, !follows || drag.at(before));
        const auto give = [&](CommandKind kind, double value) {
          EXPECT_TRUE(apply_setting({.kind = kind, .value = value}, rules, 0.004, settings).is_ok());
        };
        give(CommandKind::kSetLaw, static_cast<double>(law));
        EXPECT_EQ(settings.percepts.drag, !follows || stands_apart)
            << name_of(before) << " to " << name_of(law);
        give(CommandKind::kEnablePercept, 1);
        EXPECT_TRUE(settings.percepts.drag) << "an operator's word counts until the next law";
      }
    }
  }
}

// 1/A = 10 from the page swung all joints at 57 Hz, 0.1 two of them.
// Tries master_io: live
TEST(MasterAdapter, AGainThatIsNotStableIsRefusedWithTheGreatestThatIs) {
  Settings settings;
  const GainRules rules = gain_rules(shipped_config(), shipped_arm().arm);
  CommandKind kind = CommandKind::kSetFeedbackGain;
  const auto give = [&](double value, int joint, double delay_s) {
    return apply_setting({.kind = kind, .value = value, .joint = joint}, rules, delay_s, settings).message();
  };
  EXPECT_THAT(give(10, -1, 0.004),
              testing::MatchesRegex("1/A 10 is not stable on j3_shoulder with law sctfb and 4 ms delay; "
                                    "allowed: up to 0\\.01[0-9]*"));
  EXPECT_THAT(give(0.1, -1, 0.004), HasSubstr("j3_shoulder"));
  EXPECT_EQ(settings.feedback_gain, teleop::everywhere(teleop::kLawsOwnGain)) << "nothing was changed";
  EXPECT_EQ(give(0.1, 6, 0.004), "") << "the tool's roll bears it";
  EXPECT_EQ(settings.feedback_gain[6], 0.1);
  EXPECT_EQ(settings.feedback_gain[2], teleop::kLawsOwnGain);
  EXPECT_THAT(give(0.1, 6, 0.02), HasSubstr("j7_tool_roll with law sctfb and 20 ms delay"));
  EXPECT_THAT(give(0.01, 7, 0.004), HasSubstr("allowed: 0 to 6, or -1 for all"));
  EXPECT_THAT(give(0.01, -2, 0.004), HasSubstr("no joint -2"));
  kind = CommandKind::kSetPerceptGain;
  EXPECT_EQ(give(5, 3, 0.004), "");
  EXPECT_EQ(settings.percept_gain[3], 5);
  EXPECT_EQ(settings.percept_gain[2], 0);
  EXPECT_THAT(give(5, 7, 0.004), HasSubstr("no joint 7"));
}

// Tries master_io: drag of another law
TEST(MasterAdapter, ADragFieldOfAnotherLawIsRefused) {
  messages::DragField field{.joint_count = 7};
  field.mode = teleop::DragMode::kCoupled;
  EXPECT_THAT(refusal(field, teleop::DragMode::kSeparable),
              HasSubstr("not separable, which this master renders"));
  EXPECT_EQ(refusal(field, teleop::DragMode::kCoupled), "");
  field.mode = teleop::DragMode::kSeparable;
  EXPECT_THAT(refusal(field, teleop::DragMode::kCoupled), HasSubstr("not coupled"));
  EXPECT_EQ(refusal(field, teleop::DragMode::kSeparable), "");
}

TEST(MasterAdapter, ThePhantomsContactIsItsWorstSensorAtASurface) {
  messages::Percept percept;
  percept.valid = true;
  percept.greatest_closeness = 0.99;
  percept.closeness = 1.0;  // of another place, which leads tone and view
  EXPECT_FALSE(vicinity_of(percept, 5).contact);
  percept.greatest_closeness = 1.0;
  percept.closeness = 0.2;
  EXPECT_TRUE(vicinity_of(percept, 5).contact);
  percept.valid = false;
  EXPECT_FALSE(vicinity_of(percept, 5).contact);
}

// Tries master_io: a second process sends `slave_state`; `drag_field`
TEST(MasterAdapter, OfTwoSlavesOrPhantomsTheFirstIsFollowedAndTheSecondIsReported) {
  const auto network = dds::test_network();
  const Config config = shipped_config();
  const messages::ArmBounds bounds = messages::bounds_of(shipped_arm().arm);
  for (const std::string topic : {"slave_state", "drag_field"}) {
    Inbox inbox;
    DdsAdapter adapter(network, {bounds, config.percept.mode, gain_rules(config, shipped_arm().arm)},
                       initial_settings(config), inbox);
    dds::Participant first("first", network), second("second", network);
    std::atomic<bool> reported{false};
    dds::Reader<msg::ComponentStatus> statuses(
        second, dds::kComponentStatus, [&](const msg::ComponentStatus& status, const dds::SampleInfo&) {
          reported = status.state() == msg::ComponentState::COMPONENT_DEGRADED &&
                     status.message().to_string().find("two processes send " + topic) != std::string::npos;
        });
    dds::Writer<msg::SlaveState> slaves[]{{first, dds::kSlaveState}, {second, dds::kSlaveState}};
    dds::Writer<msg::DragField> fields[]{{first, dds::kDragField}, {second, dds::kDragField}};
    dds::Stamper stampers[]{dds::Stamper(first), dds::Stamper(second)};
    const auto joint_count = static_cast<std::uint32_t>(bounds.joint_count);
    const auto send = [&](std::size_t who) {
      if (topic == "slave_state") {
        messages::SlaveState state{.joint_count = joint_count, .position = shipped_arm().home};
        state.position[3] += 0.1 * static_cast<double>(who);
        msg::SlaveState message = messages::to_idl(state);
        message.stamp(stampers[who].next());
        slaves[who].write(message);
      } else {
        messages::DragField field{.mode = config.percept.mode, .joint_count = joint_count};
        field.drag.valid = true;
        field.drag.plus.fill(1.0 + static_cast<double>(who));
        field.drag.minus = field.drag.plus;
        msg::DragField message = messages::to_idl(field);
        message.stamp(stampers[who].next());
        fields[who].write(message);
      }
    };
    SlaveSample slave;
    DragSample drag;
    const auto heard = [&] {
      return topic == "slave_state" ? inbox.slave.read(slave) : inbox.drag.read(drag);
    };
    ASSERT_TRUE(dds::eventually([&] {
      send(0);
      return heard();
    })) << topic;
    EXPECT_TRUE(dds::eventually([&] {
      send(0);
      send(1);
      adapter.publish_health({core::ComponentState::kRunning, "", {}, {}});
      return reported.load();
    })) << topic;
    ASSERT_TRUE(heard());
    if (topic == "slave_state") {
      EXPECT_EQ(slave.position[3], shipped_arm().home[3]);
    } else {
      EXPECT_EQ(drag.drag.plus[0], 1.0);
    }
  }
}

}  // namespace
}  // namespace phantom::master_io
