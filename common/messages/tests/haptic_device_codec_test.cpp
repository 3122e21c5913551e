#include "common/messages/codecs/haptic_device_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "common/messages/tests/codec_cases.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::messages {
namespace {

using testing::HasSubstr;

HapticDevice a_device() {
  HapticDevice state;
  state.stamp = {7, 123, 99};
  state.wrench_echo = {4, 5, 6};
  state.handle.position_m = {0.1, -0.2, 0.3};
  Eigen::Map<Eigen::Matrix3d>(state.handle.R_DH.data()) =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix();
  state.handle.velocity_m_s = {1, 2, 3};
  state.handle.angular_velocity_rad_s = {-4, 5, -6};
  state.ready = state.clutch = true;
  state.buttons = 5;
  state.grip_opening = 0.25;
  state.able = {63, 7, 12.0, 0.5, 0.2, 0.01, 0.08, 1.1, 0.001};
  return state;
}

TEST(HapticDeviceCodec, ThereAndBackItIsTheSame) {
  const auto back = from_idl(to_idl(a_device()));
  ASSERT_TRUE(back) << back.status().message();
  HapticDevice expected = a_device(), found = *back;
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(found.handle.R_DH[i], expected.handle.R_DH[i], 1e-12);
  found.handle.R_DH = expected.handle.R_DH;
  EXPECT_EQ(found, expected);
}

TEST(HapticDeviceCodec, TheMessageSaysItFieldByField) {
  const msg::HapticDevice m = to_idl(a_device());
  EXPECT_EQ(m.wrench_echo().session(), 6U);
  EXPECT_EQ(m.X_DH().position_m().y(), -0.2);
  EXPECT_NEAR(m.X_DH().qy(), std::sin(0.35), 1e-12);
  EXPECT_EQ(m.velocity_m_s().z(), 3);
  EXPECT_EQ(m.angular_velocity_rad_s().x(), -4);
  EXPECT_TRUE(m.ready() && m.clutch());
  EXPECT_EQ(m.buttons(), 5U);
  EXPECT_EQ(m.grip_opening(), 0.25);
  EXPECT_EQ(m.measured_axes(), 63U);
  EXPECT_EQ(m.actuated_axes(), 7U);
  EXPECT_EQ(m.max_force_N(), 12.0);
  EXPECT_EQ(m.max_moment_N_m(), 0.5);
  EXPECT_EQ(m.mass_kg(), 0.2);
  EXPECT_EQ(m.inertia_kg_m2(), 0.01);
  EXPECT_EQ(m.workspace_m(), 0.08);
  EXPECT_EQ(m.workspace_rad(), 1.1);
  EXPECT_EQ(m.period_s(), 0.001);
}

TEST(HapticDeviceCodec, SR11_WhatCannotBeTrueIsRefused) {
  const Refusals<msg::HapticDevice> refusal{to_idl(a_device())};
  EXPECT_THAT(refusal([](auto& m) { m.X_DH().qx(m.X_DH().qx() + 0.5); }), HasSubstr("quaternion has length"));
  EXPECT_EQ(refusal([](auto& m) { m.X_DH().position_m().z(11); }), "X_DH is 11; allowed: -10 to 10");
  EXPECT_EQ(refusal([](auto& m) { m.velocity_m_s().x(-10.5); }), "velocity_m_s is -10.5; allowed: -10 to 10");
  EXPECT_THAT(refusal([](auto& m) { m.angular_velocity_rad_s().x(101); }), HasSubstr("-100 to 100"));
  for (const unsigned axes : {0U, 3U, 8U, 62U, 64U})
    EXPECT_THAT(refusal([&](auto& m) { m.measured_axes(axes); }), HasSubstr("measured_axes")) << axes;
  EXPECT_EQ(refusal([](auto& m) { m.measured_axes(7); }), "");
  EXPECT_THAT(refusal([](auto& m) { m.actuated_axes(64); }), HasSubstr("actuated_axes"));
  EXPECT_EQ(refusal([](auto& m) { m.grip_opening(-1); }), "") << "it has none";
  for (const double opening : {-0.5, 1.1, -2.0})
    EXPECT_THAT(refusal([&](auto& m) { m.grip_opening(opening); }), HasSubstr("grip_opening"));
  for (const double mass : {0.0, -1.0, 101.0})
    EXPECT_THAT(refusal([&](auto& m) { m.mass_kg(mass); }), HasSubstr("mass_kg"));
  for (const double period : {0.0, 0.0002, 0.005})
    EXPECT_THAT(refusal([&](auto& m) { m.period_s(period); }), HasSubstr("period_s"));
}

TEST(HapticDeviceCodec, ASoundSampleTakesNoHeap) {
  const msg::HapticDevice message = to_idl(a_device());
  bool sound = false;
  {
    const test::HeapGuard guard;
    sound = from_idl(message).has_value();
  }
  EXPECT_TRUE(sound);
}

HapticDeviceWrench a_wrench() {
  HapticDeviceWrench wrench;
  wrench.stamp = {7, 123, 99};
  wrench.device_echo = {1, 2, 3};
  wrench.force_N = {1, -2, 3};
  wrench.moment_N_m = {0.1, 0.2, -0.3};
  wrench.valid = wrench.leads = true;
  wrench.time_to_live_s = 0.03;
  wrench.fade_s = 0.04;
  return wrench;
}

TEST(HapticDeviceWrenchCodec, ThereAndBackItIsTheSameAndWhatCannotBeTrueIsRefused) {
  expect_same_after_round_trip(a_wrench());
  const Refusals<msg::HapticDeviceWrench> refusal{to_idl(a_wrench())};
  EXPECT_EQ(refusal.good.force_N().y(), -2);
  EXPECT_EQ(refusal.good.moment_N_m().z(), -0.3);
  EXPECT_EQ(refusal.good.device_echo().monotonic_ns(), 2);
  EXPECT_THAT(refusal([](auto& m) { m.force_N().z(1001); }), HasSubstr("-1000 to 1000"));
  EXPECT_THAT(refusal([](auto& m) { m.moment_N_m().z(-101); }), HasSubstr("-100 to 100"));
  EXPECT_THAT(refusal([](auto& m) { m.fade_s(0.0); }), HasSubstr("fade_s"));
}

TEST(HapticDeviceWrench, AWrenchThatIsNotRenewedFadesToNothing) {
  const HapticDeviceWrench wrench = a_wrench();
  EXPECT_EQ(share_at_age(wrench, 0.0), 1.0);
  EXPECT_EQ(share_at_age(wrench, 0.03), 1.0);
  EXPECT_NEAR(share_at_age(wrench, 0.05), 0.5, 1e-12);
  EXPECT_EQ(share_at_age(wrench, 0.07), 0.0);
  EXPECT_EQ(share_at_age(wrench, 1e9), 0.0);
  EXPECT_EQ(share_at_age(wrench, -1.0), 0.0) << "of a time that cannot be";
  EXPECT_EQ(share_at_age(wrench, kNoNumbers[0]), 0.0);
}

}  // namespace
}  // namespace phantom::messages
