// What ROS 2's tools show of ros2_gateway, and what other people's readers make of each message that it
// sends: nodes of another vendor's DDS stand for the tools, as ROS 2 is not at hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>

#include "common/core/clock.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/ros2/message_types.hpp"
#include "components/dds_recorder/adapter/dds_adapter_bag.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"
#include "components/ros2_gateway/dds_adapter_objects.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/ros2/graph_tools.hpp"
#include "tests/ros2/played_server.hpp"
#include "tests/ros2/wire_listener.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::ros2 {
namespace {

using test::Distribution;
using test::ForeignNode;
using test::GraphTools;
using test::ShownEndpoint;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

int ros_domain() { return phantom::test::own_domain(1); }

/// The gateway of an arm of Phantom's own.
struct Gateway {
  explicit Gateway(Graph graph) {
    ros2_gateway::GatewayConfig config;
    config.node.domain = ros_domain();
    config.node.interfaces = config.node.initial_peers = {"127.0.0.1"};
    config.node.graph = graph;
    config.joint_states_topic = "";
    config.out.views = true;
    config.workspace.clouds = {workspace::kOrderBoundary};
    adapter = std::make_unique<ros2_gateway::DdsAdapter>(
        dds::test_network(), config, arm, "<robot/>",
        [](const ros2_gateway::JointStateMessage&, messages::SlaveState&) { return core::Expected(false); });
  }
  robot::SerialArm arm = phantom::test::one_joint();
  std::unique_ptr<ros2_gateway::DdsAdapter> adapter;
};

class Tools : public testing::TestWithParam<Graph> {
 protected:
  static Distribution distribution() {
    return GetParam() == Graph::kHumble ? Distribution::kHumble : Distribution::kSinceIron;
  }
};

TEST_P(Tools, ListTheNodeItsTopicsWithTypesAndEachEndpointWithItsHash) {
  const Gateway gateway(GetParam());
  ForeignNode node(ros_domain(), distribution());
  GraphTools tools(node);
  ASSERT_TRUE(dds::eventually([&] {
    const auto info = tools.topic_info("/phantom/robot_description");
    return info.size() == 1 && info[0].node == "phantom" && tools.topic_list().size() > 11;
  })) << tools.topic_list().size();
  EXPECT_THAT(tools.node_list(), ElementsAre("/phantom"));
  const auto topics = tools.topic_list();
  const std::map<std::string, std::string> some{
      {"/phantom/joint_states", "sensor_msgs/msg/JointState"},
      {"/phantom/percept/closeness", "std_msgs/msg/Float64"},
      {"/phantom/percept/worst_place", "visualization_msgs/msg/Marker"},
      {"/tf", "tf2_msgs/msg/TFMessage"},
      {"/tf_static", "tf2_msgs/msg/TFMessage"},
      {"/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"},
      {"/collision_object", "moveit_msgs/msg/CollisionObject"}};
  for (const auto& [topic, type] : some)
    EXPECT_THAT(topics, Contains(testing::Pair(topic, ElementsAre(type))));
  int ours = 0;
  for (const auto& [topic, types] : topics) {
    for (const ShownEndpoint& shown : tools.topic_info(topic)) {
      if (shown.hash == "INVALID") continue;  // the tool's own
      ++ours;
      EXPECT_EQ(shown.node, "phantom") << topic;
      EXPECT_EQ(shown.node_namespace, "/") << topic;
      const auto slash = shown.type.rfind('/');
      const auto* known = find_message_type(shown.type.substr(0, shown.type.find('/')) +
                                            "::msg::dds_::" + shown.type.substr(slash + 1) + "_");
      ASSERT_NE(known, nullptr) << shown.type;
      EXPECT_EQ(shown.hash, known->hash) << topic;
    }
  }
  EXPECT_GE(ours, 11) << "ten out, one in";
}

INSTANTIATE_TEST_SUITE_P(Of, Tools, testing::Values(Graph::kHumble, Graph::kSinceIron),
                         [](const auto& test) { return test.param == Graph::kHumble ? "Humble" : "Jazzy"; });

TEST(Tools, HearNoGraphUntilOneIsChosen) {
  const Gateway gateway(Graph::kNone);
  ForeignNode node(ros_domain(), Distribution::kSinceIron);
  GraphTools tools(node);
  ASSERT_TRUE(dds::eventually([&] { return tools.topic_info("/diagnostics").size() == 1; }));
  EXPECT_EQ(node.endpoints().count("ros_discovery_info"), 1u) << "the tool's own reader";
  EXPECT_THAT(tools.node_list(), IsEmpty());
  EXPECT_EQ(tools.topic_info("/diagnostics")[0].node, "_CREATED_BY_BARE_DDS_APP_");
}

/// Says on Phantom's topics what the gateway hands on.
class Phantom {
 public:
  void say() {
    messages::SlaveState state;
    state.joint_count = 1, state.position[0] = 0.7, state.velocity[0] = 0.25, state.loop_torque_Nm[0] = -1.5;
    slave_.publish(state);
    messages::MasterState master;
    master.joint_count = 1, master.position[0] = 0.71, master.percept_torque_Nm[0] = 2.0;
    master_.publish(master);
    messages::Percept felt;
    felt.valid = true, felt.closeness = 0.25, felt.speed_m_s = 0.5, felt.object = 3, felt.joint_count = 1;
    felt.drag_torque_Nm[0] = -0.125, felt.position_m = {0.1, 0.2, 0.3};
    percept_.publish(felt);
    messages::HitAlert alert;
    alert.alert = 7, alert.link_name = "forearm", alert.rule = percept::HitRule::kVeryClose;
    alerts_.publish(alert);
    status_.publish({.state = core::ComponentState::kRunning, .figures = {{"ticks", 12.0, "Hz"}}});
    for (const auto view : {messages::PictureView::kMain, messages::PictureView::kHit,
                            messages::PictureView::kTool, messages::PictureView::kCamera})
      pictures_.publish({.stamp = {}, .view = view, .jpeg = {0xff, 0xd8, 1, 2, 3}});
    // Each version has one boundary voxel more, so that the cloud and its updates are said again and again.
    server_.put(7, 0.1, server_.put_mesh());
    server_.set({voxels_ % 64, voxels_ / 64 % 64, 0}, workspace::kOrderBoundary);
    ++voxels_;
    server_.commit();
  }

 private:
  dds::Participant participant_{"slave_io", dds::test_network()};
  messages::Publisher<messages::SlaveState> slave_{participant_, dds::kSlaveState};
  messages::Publisher<messages::MasterState> master_{participant_, dds::kMasterState};
  messages::Publisher<messages::Percept> percept_{participant_, dds::kPercept};
  messages::Publisher<messages::HitAlert> alerts_{participant_, dds::kHitAlert};
  messages::StatusReporter status_{participant_};
  messages::Publisher<messages::ViewPicture> pictures_{participant_, dds::kViewPicture};
  test::PlayedServer server_{participant_};
  int voxels_ = 0;
};

TEST(OtherReaders, DecodeEachMessageOnTheWireByThePublishedDefinitions) {
  Gateway gateway(Graph::kSinceIron);
  Phantom phantom;
  ForeignNode node(ros_domain(), Distribution::kSinceIron);
  GraphTools tools(node);
  test::WireListener listener(node);
  ASSERT_TRUE(dds::eventually([&] { return tools.topic_info("/phantom/robot_description").size() == 1; }))
      << testing::PrintToString(tools.topic_list()) << tools.topic_info("/phantom/robot_description").size();
  std::map<std::string, std::string> topics;  // of the gateway's, with types as DDS names them
  for (const auto& [topic, endpoint] : node.endpoints())
    if (topic.starts_with("rt/") && !endpoint.user_data.empty() && (endpoint.guid[15] & 0x3e) == 0x02)
      topics[topic] = endpoint.type;
  ASSERT_GE(topics.size(), 18u) << "every topic that it has with all of its outputs";
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> heard;
  ASSERT_TRUE(dds::eventually([&] {
    phantom.say();
    gateway.adapter->publish(true);
    bool all = true;
    for (const auto& [topic, type] : topics) {
      heard[topic] = listener.heard(topic, type);
      all = all && !heard[topic].empty();
    }
    return all;
  })) <<
      [&] {
        std::string missing;
        for (const auto& [topic, messages] : heard) missing += messages.empty() ? topic + " " : "";
        return missing;
      }();
  const auto file =
      std::filesystem::temp_directory_path() / ("ros2_wire_" + std::to_string(getpid()) + ".mcap");
  std::filesystem::remove(file);
  std::size_t count = 0;
  {
    dds_recorder::Ros2Bag bag(file, 0);
    for (const auto& [topic, messages] : heard)
      for (const auto& bytes : messages) {
        ++count;
        EXPECT_TRUE(
            bag.put(topic.substr(3), *find_message_type(topics[topic]), kDefault, bytes, count, count));
      }
    bag.finish("wire.mcap");
  }
  setenv("READERS", PHANTOM_READERS, 1);
  phantom::test::Process reader(
      {PHANTOM_NODE, PHANTOM_SOURCE_DIR "/tests/recording/read_bag.mjs", file.string()},
      file.string() + ".log");
  ASSERT_EQ(reader.wait(), 0) << reader.output();
  const auto report = nlohmann::json::parse(reader.output());
  EXPECT_EQ(report["messages"], count);
  EXPECT_EQ(report["published"], count);
  EXPECT_EQ(report["types"].size(), topics.size());
  EXPECT_EQ(report["last"]["description"]["data"], "<robot/>");
  EXPECT_THAT(report["last"]["diagnostics"].dump(), testing::HasSubstr("forearm may hit something"));
  std::filesystem::remove(file);
  std::filesystem::remove(file.string() + ".log");
}

TEST(CollisionObjects, KeepNobodyWaitingAtTheEnd) {
  Node node({.domain = ros_domain(), .interfaces = {"127.0.0.1"}, .initial_peers = {"127.0.0.1"}});
  dds::Participant participant("objects_test", dds::test_network());
  std::atomic<bool> asked{false};  // and never answered
  dds::Participant other("wva_server", dds::test_network());
  const dds::Writer<msg::WorkspaceReply> replies(other, dds::kWorkspaceReply);
  dds::Reader<msg::WorkspaceCommand> server(
      other, dds::kWorkspaceCommand,
      [&](const msg::WorkspaceCommand&, const dds::SampleInfo&) { asked = true; });
  auto objects =
      std::make_unique<ros2_gateway::CollisionObjects>(participant, node, "collision_object", "world");
  ForeignNode planner(ros_domain(), Distribution::kSinceIron);
  ASSERT_TRUE(dds::eventually([&] {
    planner.publish_sphere("ball", 0, {0.1, 0.2, 0.3}, 0.05);
    return asked.load();
  }));
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  objects.reset();
  EXPECT_LT(core::seconds(core::monotonic_ns() - begin_ns), 15.0) << "wva_server may take 30 s to answer";
}

}  // namespace
}  // namespace phantom::ros2
