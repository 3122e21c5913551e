#include "common/messages/codecs/teleoperation_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "common/messages/tests/codec_cases.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;

SlaveState a_slave_state() {
  SlaveState state;
  state.stamp = {7, 123, 99};
  state.master_echo = {41, 42, 43};
  state.state = teleop::LinkState::kDegraded;
  state.stop = {44, teleop::StopCause::kDriveFault};
  state.joint_count = 7;
  state.position = by_joint(0.1);
  state.velocity = by_joint(-0.2);
  state.loop_torque_Nm = by_joint(3.5);
  state.counterbalance = teleop::Counterbalance::kAutomatic;
  state.force_measured = true;
  state.external_torque_Nm = by_joint(-4.5);
  state.contact = true;
  state.contact_force_N = 12;
  state.contact_object = 9;
  state.contact_point_m = {1, 2, 3};
  state.tool_speed_m_s = 0.2;
  state.clearance_m = 0.03;
  return state;
}

MasterState a_master_state() {
  MasterState state;
  state.stamp = {7, 123, 99};
  state.state = teleop::LinkState::kCoupled;
  state.stop = {44, teleop::StopCause::kEmergency};
  state.law = teleop::BilateralLaw::kPfff;
  state.joint_count = 7;
  state.position = by_joint(0.1);
  state.velocity = by_joint(0.4);
  state.percept_torque_Nm = by_joint(-1);
  state.feedback_torque_Nm = by_joint(2);
  state.operator_torque_Nm = by_joint(0.5);
  state.percept_gain = 11;
  state.feedback_gain = 0.05;
  state.percept_enabled = state.percept_limited = true;
  state.drag_chosen = state.tone_enabled = state.views_enabled = false;
  state.percept_set_automatic = true;
  state.feedback_limited = state.feedback_damped = state.force_missing = true;
  state.reach = 6;
  state.slave_echo = {1, 2, 3};
  state.drag_echo = {4, 5, 6};
  state.round_trip_s = 0.001;
  return state;
}

TEST(SlaveStateCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_slave_state()); }
TEST(MasterStateCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_master_state()); }

TEST(SlaveStateCodec, TheMessageSaysItFieldByField) {
  const msg::SlaveState slave = to_idl(a_slave_state());
  EXPECT_TRUE(slave.external_torque_measured());
  EXPECT_EQ(slave.external_torque_Nm()[2], -4.5 * 3);
  EXPECT_EQ(slave.joint_count(), 7U);
  EXPECT_EQ(slave.state(), msg::LinkState::LINK_DEGRADED);
  EXPECT_EQ(slave.stop_cause(), msg::StopCause::STOP_DRIVE_FAULT);
  EXPECT_EQ(slave.stop(), 44U);
  EXPECT_EQ(slave.loop_torque_Nm()[1], 3.5 * 2);
  EXPECT_EQ(slave.counterbalance(), msg::Counterbalance::COUNTERBALANCE_AUTOMATIC);
  EXPECT_EQ(slave.master_echo().sequence_number(), 41U);
  EXPECT_EQ(slave.master_echo().monotonic_ns(), 42);
  EXPECT_EQ(slave.master_echo().session(), 43U);
  EXPECT_EQ(slave.position_rad()[0], 0.1);
  EXPECT_EQ(slave.velocity_rad_s()[0], -0.2);
  EXPECT_TRUE(slave.contact());
  EXPECT_EQ(slave.contact_force_N(), 12);
  EXPECT_EQ(slave.contact_object(), 9);
  EXPECT_EQ(slave.contact_point_m().z(), 3);
  EXPECT_EQ(slave.clearance_m(), 0.03);
  EXPECT_EQ(slave.tool_speed_m_s(), 0.2);
}

TEST(MasterStateCodec, TheMessageSaysItFieldByField) {
  const msg::MasterState master = to_idl(a_master_state());
  EXPECT_EQ(master.stamp().sequence_number(), 7U);
  EXPECT_EQ(master.stamp().monotonic_ns(), 123);
  EXPECT_EQ(master.stamp().session(), 99U);
  EXPECT_EQ(master.state(), msg::LinkState::LINK_COUPLED);
  EXPECT_EQ(master.stop_cause(), msg::StopCause::STOP_EMERGENCY);
  EXPECT_EQ(master.stop(), 44U);
  EXPECT_EQ(master.law(), msg::BilateralLaw::LAW_PFFF);
  EXPECT_TRUE(master.feedback_damped());
  EXPECT_TRUE(master.feedback_limited());
  EXPECT_TRUE(master.force_missing());
  EXPECT_EQ(master.joint_count(), 7U);
  EXPECT_EQ(master.percept_torque_Nm()[0], -1);
  EXPECT_EQ(master.feedback_torque_Nm()[1], 4);
  EXPECT_EQ(master.position_rad()[2], 0.1 * 3);
  EXPECT_EQ(master.velocity_rad_s()[3], 0.4 * 4);
  EXPECT_EQ(master.operator_torque_Nm()[4], 2.5);
  EXPECT_EQ(master.percept_gain(), 11);
  EXPECT_EQ(master.feedback_gain(), 0.05);
  EXPECT_TRUE(master.percept_enabled());
  EXPECT_FALSE(master.drag_chosen());
  EXPECT_FALSE(master.tone_enabled());
  EXPECT_FALSE(master.views_enabled());
  EXPECT_TRUE(master.percept_set_automatic());
  EXPECT_TRUE(master.percept_limited());
  EXPECT_EQ(master.reach(), 6);
  EXPECT_EQ(master.slave_echo().sequence_number(), 1U);
  EXPECT_EQ(master.drag_echo().session(), 6U);
  EXPECT_EQ(master.round_trip_s(), 0.001);
}

/// What both sides' states have in common.
template <class Message>
void expect_side_is_checked(const Message& good) {
  const Refusals<Message> refusal{good};
  for (const double bad : kNoNumbers) {
    EXPECT_EQ(refusal([&](auto& m) { m.position_rad()[3] = bad; }), "position_rad[3] (j4) is not finite");
    EXPECT_EQ(refusal([&](auto& m) { m.velocity_rad_s()[6] = bad; }), "velocity_rad_s[6] (j7) is not finite");
    EXPECT_EQ(refusal([&](auto& m) { m.position_rad()[8] = bad; }), "")
        << "beyond the joints: nobody reads it";
  }
  EXPECT_EQ(refusal([](auto& m) { m.joint_count(6); }), "joint_count is 6; allowed: 7, as the arm");
  for (const std::uint32_t count : {0U, 6U, 8U, 17U, 1000U, 4'000'000'000U})
    EXPECT_THAT(refusal([&](auto& m) { m.joint_count(count); }), HasSubstr("joint_count")) << count;
  EXPECT_EQ(refusal([](auto& m) { m.stamp().sequence_number(0); }),
            "stamp.sequence_number is 0; allowed: 1 or more");
  for (const int state : {6, 9, 17, 99}) {
    EXPECT_THAT(refusal([&](auto& m) { m.state(static_cast<msg::LinkState>(state)); }),
                HasSubstr("state is " + std::to_string(state) + "; allowed: 0 to 5"));
  }
  EXPECT_THAT(refusal([](auto& m) { m.stop_cause(static_cast<msg::StopCause>(4)); }),
              HasSubstr("stop_cause"));
  for (const double q : {1.09, 1.099, -1.099})  // 5 % of the range of 2 rad beyond: pushed onto its stop
    EXPECT_EQ(refusal([&](auto& m) { m.position_rad()[2] = q; }), "") << q;
  for (const double q : {1.101, -1.101, 1.11, 3.0, -1e9}) {
    EXPECT_THAT(refusal([&](auto& m) { m.position_rad()[2] = q; }),
                testing::MatchesRegex(
                    "position_rad\\[2\\] \\(j3\\) is .*; allowed: -1 to 1 and 5 % of that range beyond"));
  }
  EXPECT_EQ(refusal([](auto& m) { m.position_rad()[6] = 1e3; }), "") << "that joint has no limits";
}

// Tries phantom_sensing: slave state not finite … 5 %
// Tries master_io: a sample with a number … 5 % of the range
TEST(SlaveStateCodec, SR11_WhatCannotBeTrueIsRefused) {
  const msg::SlaveState good = to_idl(a_slave_state());
  expect_side_is_checked(good);
  const Refusals<msg::SlaveState> refusal{good};
  EXPECT_EQ(refusal([](auto& m) { m.contact_point_m().x(1e9); }),
            "contact_point_m is 1e+09; allowed: -10000 to 10000");
}

// Tries slave_io: master_state invalid
TEST(MasterStateCodec, SR11_WhatCannotBeTrueIsRefused) {
  const msg::MasterState good = to_idl(a_master_state());
  expect_side_is_checked(good);
  const Refusals<msg::MasterState> refusal{good};
  EXPECT_EQ(refusal([](auto& m) { m.percept_gain(-0.1); }), "percept_gain is -0.1; allowed: 0 or more");
  EXPECT_EQ(refusal([](auto& m) { m.round_trip_s(-1); }), "");
}

TEST(GripperStateCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  GripperState state;
  state.stamp = {3, 4, 5};
  state.sense = {true, 0.042, -0.01, 29.5, true, true};
  state.requested_width_m = 0.0;
  state.requested_force_N = 30.0;
  state.moves = state.holds = state.open = state.closed = true;
  state.widest_m = 0.1;
  state.least_force_N = 3.0;
  state.greatest_force_N = 60.0;
  const msg::GripperState good = to_idl(state);
  EXPECT_EQ(good.width_m(), 0.042);
  EXPECT_EQ(good.velocity_m_s(), -0.01);
  EXPECT_EQ(good.force_N(), 29.5);
  EXPECT_TRUE(good.known() && good.follows() && good.fault() && good.moves() && good.holds() && good.open() &&
              good.closed());
  const auto back = from_idl(good);
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(to_idl(*back), good);
  const Refusals<msg::GripperState> refusal{good};
  EXPECT_EQ(refusal([](auto& m) { m.width_m(1.02); }), "width_m is 1.02; allowed: -0.01 to 1.01");
  EXPECT_EQ(refusal([](auto& m) { m.width_m(-0.02); }), "width_m is -0.02; allowed: -0.01 to 1.01");
  EXPECT_THAT(refusal([](auto& m) { m.requested_width_m(-0.001); }), HasSubstr("requested_width_m"));
  EXPECT_THAT(refusal([](auto& m) { m.requested_width_m(1.1); }), HasSubstr("requested_width_m"));
  EXPECT_THAT(refusal([](auto& m) { m.widest_m(0.0); }), HasSubstr("widest_m"));
  EXPECT_THAT(refusal([](auto& m) { m.requested_force_N(0.0); }), HasSubstr("requested_force_N"));
  EXPECT_THAT(refusal([](auto& m) { m.least_force_N(0.0); }), HasSubstr("least_force_N"));
  EXPECT_THAT(refusal([](auto& m) { m.greatest_force_N(20'000.0); }), HasSubstr("greatest_force_N"));
}

TEST(WristWrenchCodec, SR11_ThereAndBackItIsTheSameAndWhatIsNoWrenchIsRefused) {
  const WristWrench wrench{
      .stamp = {3, 4, 5}, .valid = true, .force_N = {1, -2, 3}, .torque_Nm = {-4, 5, 1e6}};
  expect_same_after_round_trip(wrench);
  const msg::WristWrench good = to_idl(wrench);
  EXPECT_EQ(good.force_N().y(), -2.0);
  EXPECT_EQ(good.torque_Nm().x(), -4.0);
  const Refusals<msg::WristWrench> refusal{good};
  EXPECT_EQ(refusal([](auto& m) { m.force_N().x(-2e6); }), "force_N is -2e+06; allowed: -1e+06 to 1e+06");
  EXPECT_THAT(refusal([](auto& m) { m.torque_Nm().y(2e6); }), HasSubstr("torque_Nm"));
  const test::HeapGuard guard;
  EXPECT_TRUE(from_idl(good).has_value());
}

TEST(ViewPoseCodec, ThereAndBackItIsTheSameAndWhatIsNoPoseIsRefused) {
  ViewPose view;
  view.stamp = {3, 4, 5};
  view.hit_zone = true;
  view.node = 12;
  view.automatic = true;
  view.X_WC = {Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix(), {1, 2, 3}};
  view.look_at_m = {2, 2, 3};
  const msg::ViewPose good = to_idl(view);
  const auto back = from_idl(good);
  ASSERT_TRUE(back) << back.status().message();
  EXPECT_EQ(back->stamp, view.stamp);
  EXPECT_TRUE(back->hit_zone);
  EXPECT_EQ(back->node, 12);
  EXPECT_TRUE(back->automatic);
  EXPECT_TRUE(back->X_WC.rotation.isApprox(view.X_WC.rotation, 1e-12));
  EXPECT_EQ(back->X_WC.translation_m, view.X_WC.translation_m);
  EXPECT_EQ(back->look_at_m, view.look_at_m);
  const Refusals<msg::ViewPose> refusal{good};
  EXPECT_THAT(refusal([](auto& m) { m.X_WC().qw(m.X_WC().qw() + 0.5); }), HasSubstr("X_WC's quaternion"));
  EXPECT_THAT(refusal([](auto& m) { m.X_WC().qx(kNoNumbers[0]); }), HasSubstr("X_WC's quaternion"));
  EXPECT_THAT(refusal([](auto& m) { m.X_WC().position_m().y(kNoNumbers[0]); }),
              HasSubstr("X_WC.position_m is not finite"));
  EXPECT_THAT(refusal([](auto& m) { m.look_at_m().z(kNoNumbers[0]); }), HasSubstr("look_at_m"));
  EXPECT_EQ(refusal([](auto& m) { m.node(15); }), "node is 15; allowed: 0 to 14");
}

TEST(ViewPictureCodec, ThereAndBackItIsTheSameAndWhatIsNoPictureIsRefused) {
  const ViewPicture picture{.stamp = {3, 4, 5}, .view = PictureView::kTool, .jpeg = {0xff, 0xd8, 7}};
  expect_same_after_round_trip(picture);
  const Refusals<msg::ViewPicture> refusal{to_idl(picture)};
  EXPECT_EQ(refusal([](auto& m) { m.jpeg().clear(); }), "jpeg has 0 octets; allowed: 1 to 4194304");
  EXPECT_THAT(refusal([](auto& m) { m.jpeg().resize(4'194'305); }), HasSubstr("4194305 octets"));
}

TEST(CameraPictureCodec, SR11_ThereAndBackItIsTheSameAndWhatIsNoPictureIsRefused) {
  const CameraPicture picture{.stamp = {3, 4, 5},
                              .camera = "gate",
                              .exposed_utc_ns = 1'700'000'000'123'456'789,
                              .width = 1280,
                              .height = 720,
                              .jpeg = {0xff, 0xd8, 7}};
  expect_same_after_round_trip(picture);
  const Refusals<msg::CameraPicture> refusal{to_idl(picture)};
  EXPECT_EQ(refusal([](auto& m) { m.jpeg().clear(); }), "jpeg has 0 octets; allowed: 1 to 4194304");
  EXPECT_THAT(refusal([](auto& m) { m.jpeg().resize(4'194'305); }), HasSubstr("4194305 octets"));
  EXPECT_EQ(refusal([](auto& m) { m.width(15); }), "width is 15; allowed: 16 to 8192");
  EXPECT_EQ(refusal([](auto& m) { m.height(8193); }), "height is 8193; allowed: 16 to 8192");
  EXPECT_EQ(refusal([](auto& m) { m.width(8192), m.height(2049); }),
            "width·height is 16785408; allowed: at most 16777216");
  EXPECT_EQ(refusal([](auto& m) { m.width(8192), m.height(2048); }), "");
  EXPECT_EQ(refusal([](auto& m) { m.camera(""); }), "camera is empty; allowed: its name");
  EXPECT_THAT(refusal([](auto& m) { m.exposed_utc_ns(1ULL << 63); }), HasSubstr("exposed_utc_ns is 9.2"));
  EXPECT_EQ(refusal([](auto& m) { m.exposed_utc_ns(0); }), "") << "not said";
}

TEST(SensorPointsCodec, SR11_ThereAndBackTheyAreTheSameAndWhatAreNoPointsIsRefused) {
  const SensorPoints points{.stamp = {3, 4, 5},
                            .measured_utc_ns = 1'700'000'000'123'456'789,
                            .frame = "camera",
                            .width = 2,
                            .height = 1,
                            .xyz_m = {1.0F, -2.0F, 3.0F, 0.0F, 0.5F, -1.0F}};
  expect_same_after_round_trip(points);
  const Refusals<msg::SensorPoints> refusal{to_idl(points)};
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(refusal([&](auto& m) { m.xyz_m() = {1, 2, 3, kNone, kNone, kNone}; }), "") << "nothing measured";
  EXPECT_THAT(refusal([&](auto& m) { m.xyz_m()[1] = kNone; }), HasSubstr("a point that is none"));
  EXPECT_THAT(refusal([&](auto& m) { m.xyz_m()[5] = std::numeric_limits<float>::infinity(); }),
              HasSubstr("a point that is none"));
  EXPECT_THAT(refusal([&](auto& m) { m.xyz_m()[0] = 1e5F; }), HasSubstr("too far"));
  EXPECT_EQ(refusal([](auto& m) { m.width(3); }), "xyz_m has 6 values; allowed: 3·width·height");
  EXPECT_EQ(refusal([](auto& m) { m.height(0); }), "height is 0; allowed: 1 to 1e+06");
  EXPECT_THAT(refusal([](auto& m) { m.width(0); }), HasSubstr("width is 0"));
  EXPECT_THAT(refusal([](auto& m) { m.width(1'000), m.height(10'000); }),
              HasSubstr("width·height is 10000000"));
}

TEST(SlaveStateCodec, WhoKnowsNoArmTakesAnyThatCanBe) {
  msg::SlaveState message = to_idl(a_slave_state());
  message.joint_count(3);
  message.position_rad()[0] = 100.0;
  EXPECT_TRUE(from_idl(message));
  EXPECT_EQ(from_idl(message)->position[3], 0.0) << "beyond its joints";
  for (const std::uint32_t count : {0U, 17U, 4'000'000'000U}) {
    message.joint_count(count);
    EXPECT_THAT(from_idl(message).status().message(), HasSubstr("allowed: 1 to 16"));
  }
}

TEST(SlaveStateCodec, ASoundSampleTakesNoHeap) {
  const msg::SlaveState message = to_idl(a_slave_state());
  const ArmBounds arm = an_arm();
  bool sound = false;
  {
    const test::HeapGuard guard;
    sound = from_idl(message, arm).has_value();
  }
  EXPECT_TRUE(sound);
}

TEST(Answer, OneThatFollowsAnotherIsToldFromOneThatFollowsNobodyYet) {
  const SlaveState state = a_slave_state();
  const auto echoes_other_session = [&](std::uint64_t session) {
    return Answer<SlaveState>(state, {3, 1, session}, 77, 8).echoes_other_session;
  };
  EXPECT_FALSE(echoes_other_session(0)) << "no echo yet";
  EXPECT_FALSE(echoes_other_session(8));
  EXPECT_TRUE(echoes_other_session(9));
  EXPECT_EQ((Answer<SlaveState>(state, {}, 77, 8).received_ns), 77);
}

TEST(Answer, AnEchoOfATimeThatCannotBeIsNone) {
  const auto answers_ns = [](core::Nanoseconds echoed_ns) {
    return Answer<SlaveState>({}, {5, echoed_ns, 42}, 1000, 42).answers_ns;
  };
  for (const core::Nanoseconds odd_ns :
       {std::numeric_limits<core::Nanoseconds>::min(), core::Nanoseconds{-1}, core::Nanoseconds{1001},
        std::numeric_limits<core::Nanoseconds>::max()}) {
    EXPECT_EQ(answers_ns(odd_ns), 0);
  }
  EXPECT_EQ(answers_ns(400), 400);
}

}  // namespace
}  // namespace phantom::messages
