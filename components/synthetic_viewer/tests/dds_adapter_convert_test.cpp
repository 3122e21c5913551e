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
  return !convert(message).has_value();
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
  messages::SkinPercept percept;
  percept.valid = true;
  percept.patch_m = 0.02;
  percept.greatest_mu_Pa_s_per_m = 32;
  percept.felt = {{7, {}, 8}, {0, {}, 100}};  // the object's skin: closer than the closest layer
  const SkinSample sample = skin_of(percept, 5);
  EXPECT_TRUE(sample.valid);
  ASSERT_EQ(sample.felt.size(), 2U);
  EXPECT_EQ(sample.felt[0].link, 7U);
  EXPECT_EQ(sample.felt[0].closeness, 0.25F);
  EXPECT_EQ(sample.felt[1].closeness, 1.0F);
  percept.valid = false;
  EXPECT_FALSE(skin_of(percept, 5).valid);
  EXPECT_TRUE(skin_of(percept, 5).felt.empty());
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
