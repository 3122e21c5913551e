#include "common/ros2/introspection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "common/dds/endpoints/cdr.hpp"
#include "common/diagnostics/decode.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/message_types.hpp"
#include "ros2_idl/diagnostic_msgsPubSubTypes.hpp"
#include "ros2_idl/message_types.hpp"
#include "ros2_idl/rmw_dds_commonPubSubTypes.hpp"
#include "ros2_idl/rmw_dds_common_humblePubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"

namespace phantom::ros2 {
namespace {

using testing::ElementsAre;

// Serialised by the generated code.
template <class PubSubType>
std::vector<std::uint8_t> cdr(const typename PubSubType::type& message) {
  const Topic<PubSubType> topic("any", {});
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(dds::CdrCodec(topic.spec()).encode(&message, bytes));
  return bytes;
}

nlohmann::ordered_json shown(const std::string& type, const std::vector<std::uint8_t>& bytes) {
  const auto tree = type_tree(type);
  if (!tree) return nullptr;
  const auto decoded = diagnostics::decode(*tree, bytes);
  EXPECT_TRUE(decoded) << decoded.status().message();
  return *decoded;
}

TEST(TypeTrees, DecodeWhatTheGeneratedCodeWrote) {
  sensor_msgs::msg::dds_::JointState_ joints;
  joints.header().stamp().sec(-7);
  joints.header().frame_id("base");
  joints.name({"elbow", "wrist"});
  joints.position({0.5, -1.25});
  const auto json = shown("sensor_msgs::msg::dds_::JointState_",
                          cdr<sensor_msgs::msg::dds_::JointState_PubSubType>(joints));
  EXPECT_EQ(json.dump(),
            R"({"header":{"stamp":{"sec":-7,"nanosec":0},"frame_id":"base"},"name":["elbow","wrist"],)"
            R"("position":[0.5,-1.25],"velocity":[],"effort":[]})");
  diagnostic_msgs::msg::dds_::DiagnosticStatus_ status;
  status.level(2);
  status.message("hot");
  EXPECT_EQ(shown("diagnostic_msgs::msg::dds_::DiagnosticStatus_",
                  cdr<diagnostic_msgs::msg::dds_::DiagnosticStatus_PubSubType>(status))["level"],
            2);
}

TEST(TypeTrees, AreThereForEachTypeOfTheIdl) {
  for (const MessageType& type : kMessageTypes) {
    const auto tree = type_tree(type.dds_name);
    ASSERT_NE(tree, nullptr) << type.name;
    EXPECT_EQ(tree->name, type.name);
    EXPECT_EQ(ros_type(type.dds_name), type.name);
  }
  EXPECT_EQ(type_tree("std_msgs::msg::dds_::Nothing_"), nullptr);
}

TEST(Names, AreTakenFromThoseOfDds) {
  EXPECT_EQ(ros_topic("rt/tf"), "/tf");
  EXPECT_EQ(ros_topic("slave_state"), "");
  EXPECT_EQ(ros_type("phantom::msg::Percept"), "");
  EXPECT_EQ(ros_type("a::msg::dds_::B"), "");
  EXPECT_EQ(hash_in("typehash=RIHS01_ab;"), "RIHS01_ab");
  EXPECT_EQ(hash_in("a=b;typehash=RIHS01_cd"), "RIHS01_cd");
  EXPECT_EQ(hash_in("enclave=/;"), "");
}

template <class Info, class Node, class Gid>
Info graph(std::uint8_t number) {
  const auto gid = [](std::uint8_t first, std::uint8_t last) {
    Gid made;
    made.data().fill(0);
    made.data()[0] = first, made.data()[15] = last;
    return made;
  };
  Node node;
  node.node_namespace("/arm"), node.node_name("talker");
  node.writer_gid_seq({gid(number, 3)}), node.reader_gid_seq({gid(number, 4)});
  Node root;
  root.node_namespace("/"), root.node_name("other");
  Info info;
  info.gid(gid(number, 0xc1));
  info.node_entities_info_seq({node, root});
  return info;
}

TEST(Graphs, OfEitherFormNameTheNodesAndTheirEndpoints) {
  namespace iron = rmw_dds_common::msg::dds_;
  namespace humble = rmw_dds_common_humble::msg::dds_;
  const std::vector<std::vector<std::uint8_t>> forms{
      cdr<iron::ParticipantEntitiesInfo_PubSubType>(
          graph<iron::ParticipantEntitiesInfo_, iron::NodeEntitiesInfo_, iron::Gid_>(5)),
      cdr<humble::ParticipantEntitiesInfo_PubSubType>(
          graph<humble::ParticipantEntitiesInfo_, humble::NodeEntitiesInfo_, humble::Gid_>(5))};
  for (const auto& bytes : forms) {
    const auto read = read_graph(bytes);
    ASSERT_TRUE(read.has_value());
    EXPECT_EQ(read->participant[0], 5);
    EXPECT_EQ(read->participant[15], 0xc1);
    ASSERT_EQ(read->nodes.size(), 2u);
    EXPECT_EQ(read->nodes[0].name, "/arm/talker");
    EXPECT_EQ(read->nodes[1].name, "/other");
    ASSERT_EQ(read->nodes[0].endpoints.size(), 2u);
    EXPECT_EQ(read->nodes[0].endpoints[0][15], 3);
  }
  EXPECT_NE(read_graph(forms[0])->form, read_graph(forms[1])->form);
}

TEST(Graphs, ThatAreGarbageAreNone) {
  std::mt19937 random(7);
  const auto sound = cdr<rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_PubSubType>(
      graph<rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_, rmw_dds_common::msg::dds_::NodeEntitiesInfo_,
            rmw_dds_common::msg::dds_::Gid_>(5));
  for (std::size_t length = 0; length < sound.size() - 3; ++length)
    EXPECT_FALSE(read_graph({sound.data(), length}).has_value()) << length;
  for (int i = 0; i < 20'000; ++i) {
    auto bytes = sound;
    for (int hit = 0; hit <= i % 3; ++hit)
      bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
    const auto read = read_graph(bytes);
    EXPECT_TRUE(!read || read->nodes.size() <= 2);
  }
}

}  // namespace
}  // namespace phantom::ros2
