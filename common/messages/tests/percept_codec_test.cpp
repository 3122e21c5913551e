#include "common/messages/codecs/percept_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/messages/tests/codec_cases.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;

DragField a_drag_field() {
  DragField field;
  field.stamp = {3, 4, 5};
  field.slave_echo = {9, 12345, 4};
  field.master_echo = {8, 7, 6};
  field.workspace_version = 2;
  field.mode = teleop::DragMode::kCoupled;
  field.joint_count = 7;
  field.drag.plus = by_joint(0.1);
  field.drag.minus = by_joint(0.2);
  for (std::size_t k = 0; k < 28; ++k) field.drag.coupled[k] = 0.5 * static_cast<double>(k);
  field.drag.drift = by_joint(-0.05);
  field.reaction = {.torque = by_joint(-0.3), .stiffness = by_joint(7.0), .position = by_joint(0.4)};
  field.drag.valid = true;
  field.model_age_s = 0.002;
  return field;
}

Percept a_percept() {
  Percept percept;
  percept.stamp = {3, 4, 5};
  percept.slave_echo = {9, 12345, 4};
  percept.workspace_version = 2;
  percept.valid = true;
  percept.condition = PerceptCondition::kWorkspaceBehind;
  percept.mu_Pa_s_per_m = 13;
  percept.closeness = 0.5;
  percept.speed_m_s = 0.3;
  percept.position_m = {1, 2, 3};
  percept.velocity_m_s = {0.1, 0.2, 0.3};
  percept.pgv = {-1, 0, 1};
  percept.pgs = 4;
  percept.motion = percept::MotionClass::kDangerous;
  percept.link = 7;
  percept.sensor = 4711;
  percept.object = 9;
  percept.joint_count = 7;
  percept.drag_torque_Nm = by_joint(-0.5);
  percept.tick_s = 2e-5;
  percept.muted_sensors = 3;
  percept.allowed_contacts = 2;
  percept.greatest_mu_Pa_s_per_m = 20;
  percept.greatest_closeness = 0.625;
  Threat threat;
  threat.rule = percept::HitRule::kFarNearing;
  threat.raises = true;
  threat.link = 3;
  threat.sensor = 12;
  threat.object = 9;
  threat.mu_Pa_s_per_m = 9;
  threat.closeness = 0.25;
  threat.speed_m_s = 0.2;
  threat.position_m = {4, 5, 6};
  threat.velocity_m_s = {0.2, 0, 0};
  threat.pgv = {0, 1, 0};
  threat.pgs = 8;
  threat.motion = percept::MotionClass::kNeutral;
  threat.contact = {0.7, 0.1, 0.12};
  percept.threats.push_back(threat);
  threat.link = 4;
  threat.contact = {};
  percept.threats.push_back(threat);
  return percept;
}

HitAlert a_hit_alert() {
  HitAlert alert;
  alert.stamp = {3, 4, 5};
  alert.utc_ns = 1234567;
  alert.alert = 3;
  alert.rule = percept::HitRule::kFarNearing;
  alert.link = 2;
  alert.link_name = "forearm";
  alert.sensor = 815;
  alert.object = 9;
  alert.look_at_m = {0.1, 0.4, 0.2};
  alert.pgv = {1, 0, 0};
  alert.speed_m_s = 0.2;
  alert.mu_Pa_s_per_m = 32;
  alert.cleared = true;
  alert.interest_point = "elbow";
  alert.contact = {0.4, 0.05, 0.06};
  return alert;
}

InterestPoints some_interest_points() {
  InterestPoints points;
  points.stamp = {3, 4, 5};
  points.slave_echo = {9, 12345, 4};
  points.workspace_version = 2;
  points.valid = true;
  points.condition = PerceptCondition::kWorkspaceUnattended;
  points.points.push_back({"elbow",
                           3,
                           13,
                           0.5,
                           0.3,
                           {1, 2, 3},
                           {0.1, 0.2, 0.3},
                           {-1, 0, 1},
                           4,
                           percept::MotionClass::kSafe,
                           percept::HitRule::kModerateMoving,
                           9,
                           true});
  points.points.push_back({"wrist"});
  return points;
}

SkinPercept a_skin_percept() {
  SkinPercept skin;
  skin.stamp = {3, 4, 5};
  skin.slave_echo = {9, 12345, 4};
  skin.workspace_version = 2;
  skin.valid = true;
  skin.patch_m = 0.02;
  skin.greatest_mu_Pa_s_per_m = 32;
  skin.patch_count = 500;
  skin.felt = {{7, {0.1F, 0.2F, 0.3F}, 8}, {2, {}, 100}};
  return skin;
}

TEST(InterestPointsCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(some_interest_points()); }
TEST(SkinPerceptCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_skin_percept()); }
TEST(DragFieldCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_drag_field()); }
TEST(PerceptCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_percept()); }
TEST(HitAlertCodec, ThereAndBackItIsTheSame) { expect_same_after_round_trip(a_hit_alert()); }

TEST(DragFieldCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::DragField> refusal{to_idl(a_drag_field())};
  for (const double bad : {kNoNumbers[0], -0.1}) {  // a coefficient below 0 would push
    EXPECT_THAT(refusal([&](auto& m) { m.coefficient_plus()[2] = bad; }), HasSubstr("coefficient_plus[2]"));
    EXPECT_THAT(refusal([&](auto& m) { m.coefficient_minus()[6] = bad; }), HasSubstr("coefficient_minus[6]"));
  }
  EXPECT_THAT(refusal([](auto& m) { m.drift()[3] = kNoNumbers[1]; }), HasSubstr("drift[3]"));
  EXPECT_EQ(refusal([](auto& m) { m.drift()[3] = -0.1; }), "") << "either way";
  EXPECT_THAT(refusal([](auto& m) { m.reaction()[1] = kNoNumbers[0]; }), HasSubstr("reaction[1]"));
  EXPECT_THAT(refusal([](auto& m) { m.reaction_stiffness()[1] = -0.1; }), HasSubstr("reaction_stiffness[1]"));
  EXPECT_THAT(refusal([](auto& m) { m.reaction_position()[1] = kNoNumbers[2]; }),
              HasSubstr("reaction_position[1]"));
  EXPECT_THAT(refusal([](auto& m) { m.coupled()[27] = kNoNumbers[0]; }), HasSubstr("matrix"));
  EXPECT_EQ(refusal([](auto& m) { m.coupled()[27] = -0.1; }), "") << "off the diagonal anything may be";
  EXPECT_EQ(refusal([](auto& m) {
              m.mode(msg::DragMode::DRAG_SEPARABLE);
              m.coupled()[27] = kNoNumbers[0];
            }),
            "")
      << "not used in this mode";
  EXPECT_THAT(refusal([](auto& m) { m.joint_count(8); }), HasSubstr("joint_count"));
  EXPECT_THAT(refusal([](auto& m) { m.model_age_s(kNoNumbers[0]); }), HasSubstr("model_age_s"));
}

TEST(PerceptCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::Percept> refusal{to_idl(a_percept())};
  for (const double closeness : {1.01, 1.1, -0.1})
    EXPECT_THAT(refusal([&](auto& m) { m.closeness(closeness); }), HasSubstr("allowed: 0 to 1"));
  EXPECT_EQ(refusal([](auto& m) { m.mu(-1); }), "mu is -1; allowed: 0 or more");
  EXPECT_EQ(refusal([](auto& m) { m.speed_m_s(-0.1); }), "speed_m_s is -0.1; allowed: 0 to 100");
  EXPECT_EQ(refusal([](auto& m) { m.link(8); }), "link is 8; allowed: 0 to 7");
  EXPECT_THAT(refusal([](auto& m) { m.position_m().x(1e9); }), HasSubstr("position_m is 1e+09"));
  for (const std::uint32_t count : {0U, 6U, 17U, 4'000'000'000U})
    EXPECT_THAT(refusal([&](auto& m) { m.joint_count(count); }), HasSubstr("joint_count")) << count;
}

TEST(PerceptCodec, WhoKnowsNoArmTakesAnyThatCanBe) {
  msg::Percept message = to_idl(a_percept());
  message.joint_count(3);
  EXPECT_TRUE(from_idl(message));
  for (const std::uint32_t count : {0U, 17U, 4'000'000'000U}) {
    message.joint_count(count);
    EXPECT_THAT(from_idl(message).status().message(), HasSubstr("allowed: 1 to 16"));
  }
}

TEST(PerceptCodec, AThreatThatCannotBeTrueIsRefused) {
  const Refusals<msg::Percept> refusal{to_idl(a_percept())};
  EXPECT_THAT(refusal([](auto& m) { m.greatest_closeness(1.1); }), HasSubstr("greatest_closeness"));
  EXPECT_EQ(refusal([](auto& m) { m.threats()[1].link(8); }), "link is 8; allowed: 0 to 7");
  EXPECT_THAT(refusal([](auto& m) { m.threats()[0].time_to_contact_error_s(-2.0); }),
              HasSubstr("time_to_contact_error_s is -2; allowed: -1 or more"));
}

TEST(HitAlertCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::HitAlert> refusal{to_idl(a_hit_alert())};
  EXPECT_EQ(refusal([](auto& m) { m.alert(0); }), "alert is 0; allowed: 1 or more");
  EXPECT_THAT(refusal([](auto& m) { m.link(20); }), HasSubstr("link is 20"));
}

TEST(InterestPointsCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::InterestPoints> refusal{to_idl(some_interest_points())};
  EXPECT_THAT(refusal([](auto& m) { m.points()[1].mu(-1); }), HasSubstr("mu is -1"));
  EXPECT_THAT(refusal([](auto& m) { m.points()[0].closeness(1.1); }), HasSubstr("closeness"));
  EXPECT_THAT(refusal([](auto& m) { m.points()[0].speed_m_s(kNoNumbers[1]); }), HasSubstr("speed_m_s"));
  EXPECT_THAT(refusal([](auto& m) { m.points()[0].position_m().x(kNoNumbers[0]); }), HasSubstr("position_m"));
  EXPECT_THAT(refusal([](auto& m) { m.points()[0].link(8); }), HasSubstr("link is 8"));
}

TEST(SkinPerceptCodec, WhatCannotBeTrueIsRefused) {
  const Refusals<msg::SkinPercept> refusal{to_idl(a_skin_percept())};
  EXPECT_THAT(refusal([](auto& m) { m.felt()[0].link(8); }), HasSubstr("link is 8"));
  EXPECT_THAT(refusal([](auto& m) { m.felt()[1].mu(-1); }), HasSubstr("mu is -1"));
  EXPECT_THAT(refusal([](auto& m) { m.felt()[1].x_m(std::nanf("")); }), HasSubstr("x_m"));
  for (const double edge_m : {0.0, 11.0})
    EXPECT_THAT(refusal([&](auto& m) { m.patch_m(edge_m); }), HasSubstr("patch_m is"));
  EXPECT_THAT(refusal([](auto& m) { m.greatest_mu(kNoNumbers[0]); }), HasSubstr("greatest_mu"));
}

TEST(HitAlertCodec, NamesAreCutToWhatTheTopicTakes) {
  HitAlert alert = a_hit_alert();
  alert.link_name = std::string(100, 'l');
  alert.interest_point = std::string(100, 'p');
  const auto back = from_idl(to_idl(alert));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->link_name, std::string(64, 'l'));
  EXPECT_EQ(back->interest_point, std::string(32, 'p'));
}

}  // namespace
}  // namespace phantom::messages
