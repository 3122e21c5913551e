#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "components/synthetic_viewer/dds_adapter.hpp"
#include "components/synthetic_viewer/tests/slave_message.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// Whether a message is refused after `change`.
template <class T, class Change>
bool refused(T message, Change change) {
  change(message);
  if constexpr (requires { convert(message, kShape); }) {
    return !convert(message, kShape).has_value();
  } else {
    return !convert(message).has_value();
  }
}

TEST(Conversion, SlaveState) {
  const auto sample = convert(slave_state(), kShape);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->state, LinkState::kCoupled);
  EXPECT_EQ(sample->position[2], 0.5);
  const auto fails = [](auto change) { return refused(slave_state(), change); };
  EXPECT_TRUE(fails([](auto& m) { m.stamp(stamp(0)); }));
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(6); }));
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(1000); }));
  EXPECT_TRUE(fails([](auto& m) { m.position_rad()[6] = kNan; }));
  EXPECT_TRUE(fails([](auto& m) { m.velocity_rad_s()[0] = -INFINITY; }));
  EXPECT_TRUE(fails([](auto& m) { m.tool_speed_m_s(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.contact_point_m().x(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.state(static_cast<msg::LinkState>(6)); }));
}

TEST(Conversion, MasterState) {
  msg::MasterState message;
  message.stamp(stamp(1));
  message.joint_count(7);
  message.percept_gain(1.5);
  message.round_trip_s(-1);
  ASSERT_TRUE(convert(message, kShape));
  EXPECT_EQ(convert(message, kShape)->percept_gain, 1.5);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.joint_count(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.percept_torque_Nm()[3] = kNan; }));
  EXPECT_TRUE(fails([](auto& m) { m.percept_gain(-0.1); }));
  EXPECT_TRUE(fails([](auto& m) { m.feedback_gain(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.law(static_cast<msg::BilateralLaw>(5)); }));
  EXPECT_TRUE(fails([](auto& m) { m.round_trip_s(INFINITY); }));
}

TEST(Conversion, Percept) {
  msg::Percept message;
  message.stamp(stamp(1));
  message.joint_count(7);
  message.valid(true);
  message.closeness(0.5);
  message.link(7);
  ASSERT_TRUE(convert(message, kShape));
  EXPECT_EQ(convert(message, kShape)->link, 7U);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.closeness(1.01); }));
  EXPECT_TRUE(fails([](auto& m) { m.closeness(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.mu(-1); }));
  EXPECT_TRUE(fails([](auto& m) { m.link(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.pgv().z(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.position_m().x(1e9); }));
  EXPECT_TRUE(fails([](auto& m) { m.motion(static_cast<msg::MotionClass>(9)); }));
}

TEST(Conversion, HitAlert) {
  msg::HitAlert message;
  message.stamp(stamp(1));
  message.alert(3);
  message.rule(msg::HIT_FAR_NEARING);
  message.link(2);
  message.link_name("forearm");
  message.look_at_m().y(0.4);
  const auto sample = convert(message, kShape);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->rule, HitRule::kFarNearing);
  EXPECT_EQ(sample->link_name, "forearm");
  EXPECT_EQ(sample->look_at_m[1], 0.4);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.alert(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.link(20); }));
  EXPECT_TRUE(fails([](auto& m) { m.look_at_m().x(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.speed_m_s(kNan); }));
}

TEST(Conversion, WorkspaceObject) {
  msg::WorkspaceObject message;
  message.id(4);
  message.name("vice");
  message.mesh_hash(99);
  message.X_WO().qw(1);
  message.red(0.5F);
  ASSERT_TRUE(convert(message));
  EXPECT_TRUE(convert(message)->X_WO.rotation.isIdentity());
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.id(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.id(65535); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qw(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qw(2); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().qx(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.X_WO().position_m().z(kNan); }));
  EXPECT_TRUE(fails([](auto& m) { m.green(1.5F); }));
  EXPECT_TRUE(fails([](auto& m) { m.blue(std::nanf("")); }));
}

TEST(Conversion, WorkspaceVersion) {
  msg::WorkspaceVersion message;
  message.version(3);
  message.voxel_size_m(0.005);
  ASSERT_TRUE(convert(message));
  EXPECT_EQ(convert(message)->voxel_size_m, 0.005);
  EXPECT_TRUE(refused(message, [](auto& m) { m.version(0); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.voxel_size_m(0); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.voxel_size_m(kNan); }));
}

TEST(Conversion, SkinPercept) {
  msg::SkinPercept message;
  message.stamp(stamp(1));
  message.valid(true);
  message.patch_m(0.02);
  message.greatest_mu(32);
  message.felt().resize(2);
  message.felt()[0].link(7);
  message.felt()[0].mu(8);
  message.felt()[1].mu(100);  // the object's skin: closer than the closest layer
  const auto sample = convert(message, kShape);
  ASSERT_TRUE(sample);
  EXPECT_TRUE(sample->valid);
  ASSERT_EQ(sample->felt.size(), 2U);
  EXPECT_EQ(sample->felt[0].link, 7U);
  EXPECT_EQ(sample->felt[0].closeness, 0.25F);
  EXPECT_EQ(sample->felt[1].closeness, 1.0F);
  const auto fails = [&message](auto change) { return refused(message, change); };
  EXPECT_TRUE(fails([](auto& m) { m.felt()[0].link(8); }));
  EXPECT_TRUE(fails([](auto& m) { m.felt()[1].mu(-1); }));
  EXPECT_TRUE(fails([](auto& m) { m.felt()[1].x_m(std::nanf("")); }));
  EXPECT_TRUE(fails([](auto& m) { m.patch_m(0); }));
  EXPECT_TRUE(fails([](auto& m) { m.greatest_mu(kNan); }));
  message.valid(false);
  EXPECT_FALSE(convert(message, kShape)->valid);
  EXPECT_TRUE(convert(message, kShape)->felt.empty());
}

TEST(Conversion, MeshChunk) {
  msg::MeshChunk message;
  message.chunk_count(2);
  message.vertex_count(3);
  message.triangle_count(1);
  message.data({1, 2, 3});
  EXPECT_TRUE(convert(message));
  EXPECT_TRUE(refused(message, [](auto& m) { m.chunk(2); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.data({}); }));
}

TEST(Conversion, ComponentStatus) {
  msg::ComponentStatus message;
  message.stamp(stamp(1));
  message.component_name("slave_io");
  message.state(msg::COMPONENT_RUNNING);
  message.loops().resize(1);
  message.loops()[0].rate_hz(999);
  message.topics().resize(2);
  message.topics()[0].refused(2);
  message.topics()[1].refused(3);
  const auto sample = convert(message);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->refused, 5U);
  EXPECT_EQ(sample->loops.at(0).rate_hz, 999);
  EXPECT_TRUE(refused(message, [](auto& m) { m.component_name(""); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.loops()[0].wakeup_max_us(kNan); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.state(static_cast<msg::ComponentState>(77)); }));
}

TEST(Conversion, OperatorCommand) {
  msg::OperatorCommand message;
  message.stamp(stamp(1));
  message.kind(msg::COMMAND_VIEW_NODE);
  message.value(9);
  ASSERT_TRUE(convert(message));
  EXPECT_EQ(convert(message)->kind, CommandKind::kViewNode);
  EXPECT_TRUE(refused(message, [](auto& m) { m.value(15); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.value(kNan); }));
  EXPECT_TRUE(refused(message, [](auto& m) { m.kind(static_cast<msg::CommandKind>(7)); }));
}

}  // namespace
}  // namespace phantom::synthetic_viewer
