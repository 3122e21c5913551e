// Samples as bytes: they come back, keys are those of DDS, and bytes that are no sample are refused.
#include "common/dds/endpoints/cdr.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/dds/endpoints/topic_list.hpp"
#include "fast_dds/type_support.hpp"

namespace phantom::dds {
namespace {

TEST(CdrCodec, ASampleComesBackAndItsBytesAreCdrWithTheirHeader) {
  msg::SlaveState state;
  state.stamp().sequence_number(0x0102030405060708);
  state.joint_count(7);
  state.position_rad()[6] = -1.5;
  state.clearance_m(0.25);
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(CdrCodec(kSlaveState).encode(&state, bytes));
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(bytes[1], 1) << "CDR, little-endian";
  EXPECT_EQ(bytes[4], 0x08) << "the first member, in the first place after the header";
  EXPECT_EQ(bytes[11], 0x01);
  msg::SlaveState again;
  ASSERT_TRUE(decode(kSlaveState, bytes, again));
  EXPECT_EQ(again.position_rad(), state.position_rad());
  EXPECT_EQ(again.clearance_m(), 0.25);
  std::vector<std::uint8_t> same;
  ASSERT_TRUE(CdrCodec(kSlaveState).encode(&again, same));
  EXPECT_EQ(same, bytes);
}

// In a thread of Fast DDS nobody would catch what the generated code throws.
TEST(Topics, RefuseASampleOfAnyOtherEncapsulation) {
  msg::SlaveState state;
  std::vector<std::uint8_t> bytes;
  ASSERT_TRUE(CdrCodec(kSlaveState).encode(&state, bytes));
  auto type = kSlaveState.make_type();
  int refused = 0;
  for (int kind = 0; kind < 0x10000; ++kind) {
    bytes[0] = static_cast<std::uint8_t>(kind >> 8), bytes[1] = static_cast<std::uint8_t>(kind);
    fast_dds::rtps::SerializedPayload_t payload;
    payload.data = bytes.data();
    payload.length = payload.max_size = static_cast<std::uint32_t>(bytes.size());
    EXPECT_NO_THROW(refused += fast_dds::deserialise(*type, payload, &state) ? 0 : 1) << kind;
    payload.data = nullptr;
  }
  EXPECT_EQ(refused, 0x10000 - 2) << "plain CDR alone is decoded, in either byte order";
}

TEST(CdrCodec, InstancesAreToldApartByTheirKeysAlone) {
  const CdrCodec codec(kWorkspaceBrick);
  ASSERT_TRUE(codec.keyed());
  const auto instance = [&](int x, int version) {
    msg::WorkspaceBrick brick;
    brick.bx(x);
    brick.version(static_cast<std::uint64_t>(version));
    std::vector<std::uint8_t> bytes;
    InstanceKey id;
    EXPECT_TRUE(codec.encode(&brick, bytes));
    EXPECT_TRUE(codec.instance_of(bytes, id));
    return id;
  };
  EXPECT_EQ(instance(3, 1), instance(3, 2));
  EXPECT_NE(instance(3, 1), instance(4, 1));
  EXPECT_FALSE(CdrCodec(kPercept).keyed());
}

TEST(CdrCodec, BytesThatAreNoSampleAreRefusedOrAtLeastSafe) {
  std::mt19937 random(7);
  for (const TopicDescription* topic : all_topics()) {
    const CdrCodec codec(*topic);
    InstanceKey id;
    EXPECT_EQ(codec.instance_of({}, id), !codec.keyed());
    for (int round = 0; round < 300; ++round) {
      std::vector<std::uint8_t> bytes(random() % 400);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : 0);
      if (bytes.size() > 1) bytes[0] = 0, bytes[1] = 1;
      (void)codec.instance_of(bytes, id);
    }
  }
}

TEST(CdrCodec, TopicsAreFoundByTypeAndByName) {
  EXPECT_EQ(topic_of_type("phantom::msg::Percept"), &kPercept);
  EXPECT_EQ(topic_named("hit_alert"), &kHitAlert);
  EXPECT_EQ(topic_of_type("other::Type"), nullptr);
}

}  // namespace
}  // namespace phantom::dds
