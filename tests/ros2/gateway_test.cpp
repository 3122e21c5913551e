// ros2_gateway beside another vendor's DDS: the nodes of a robot whose types were written by hand after the
// published definitions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <mutex>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/ros2/message_types.hpp"
#include "components/ros2_gateway/dds_adapter.hpp"
#include "components/ros2_gateway/dds_adapter_objects.hpp"
#include "tests/ros2/foreign_node.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::ros2 {
namespace {

using test::Distribution;
using test::ForeignNode;

/// The gateway between two domains, and one who hears slave_state.
class Gateway : public testing::Test {
 protected:
  void start(Graph graph) {
    ros2_gateway::GatewayConfig config;
    config.node.domain = test_domain();
    config.node.interfaces = config.node.initial_peers = {"127.0.0.1"};
    config.node.graph = graph;
    config.wrench_topic = "wrench";
    config.workspace.meshes = false;
    config.wrench_frame = "ft_sensor";
    const core::NetworkOptions network = dds::test_network();
    observer_ = std::make_unique<dds::Participant>("observer", network);
    messages::ArmBounds bounds = messages::bounds_of(arm_);
    reader_ = std::make_unique<messages::TopicSubscriber<msg::SlaveState>>(
        *observer_, dds::kSlaveState, bounds, [this](const messages::Received<messages::SlaveState>& state) {
          const std::lock_guard lock(mutex_);
          states_.push_back(state);
        });
    adapter_ = std::make_unique<ros2_gateway::DdsAdapter>(
        network, config, arm_, "<robot/>",
        [this](const ros2_gateway::JointStateMessage& message, messages::SlaveState& state) {
          return joints_.accept(message, core::monotonic_ns(), core::utc_ns(), state);
        });
  }
  static int test_domain() { return phantom::test::own_domain(1); }
  bool heard(double position, double velocity) {
    const std::lock_guard lock(mutex_);
    return std::any_of(states_.begin(), states_.end(), [&](const messages::SlaveState& state) {
      return state.joint_count == 1 && state.position[0] == position && state.velocity[0] == velocity &&
             std::abs(state.tool_speed_m_s - 0.5 * std::abs(velocity)) < 1e-12;
    });
  }

  robot::SerialArm arm_ = phantom::test::one_joint();
  ros2_gateway::JointStates joints_{arm_, {"elbow"}, {}};
  std::mutex mutex_;
  std::vector<messages::SlaveState> states_;
  std::unique_ptr<dds::Participant> observer_;
  std::unique_ptr<messages::TopicSubscriber<msg::SlaveState>> reader_;
  std::unique_ptr<ros2_gateway::DdsAdapter> adapter_;
};

TEST_F(Gateway, MakesJointStatesOfAnotherVendorTheSlavesState) {
  start(Graph::kNone);
  ForeignNode robot(test_domain(), Distribution::kSinceIron);
  ASSERT_TRUE(dds::eventually([&] { return adapter_->robots() == 1; }));
  EXPECT_TRUE(dds::eventually([&] {
    robot.publish_joints({"gripper", "elbow"}, {0.04, -1.25}, {0.0, 0.75}, core::utc_ns());
    return heard(-1.25, 0.75);
  }));
  for (int i = 0; i < 20; ++i) {
    robot.publish_joints({"elbow"}, {3.5}, {0.0}, core::utc_ns());
    robot.publish_joints({"elbow"}, {NAN}, {0.0}, core::utc_ns());
  }
  EXPECT_TRUE(dds::eventually([&] {
    robot.publish_joints({"elbow"}, {0.5}, {0.0}, core::utc_ns());
    return heard(0.5, 0.0);
  }));
  const std::lock_guard lock(mutex_);
  for (const auto& state : states_) EXPECT_LE(std::abs(state.position[0]), 2.2);
}

// Tries ros2_gateway: a wrench with a number that is none; of another frame
// Tries ros2_gateway: a ROS 2 topic that is flooded
TEST_F(Gateway, HandsOnTheWrenchOfItsFrameAtAPaceOfItsOwn) {
  start(Graph::kNone);
  std::mutex mutex;
  std::vector<messages::WristWrench> all;
  messages::TopicSubscriber<msg::WristWrench> wrist(
      *observer_, dds::kWristWrench, {}, [&](const messages::Received<messages::WristWrench>& wrench) {
        const std::lock_guard lock(mutex);
        all.push_back(wrench);
      });
  ForeignNode sensor(test_domain(), Distribution::kSinceIron);
  ASSERT_TRUE(dds::eventually([&] {
    sensor.publish_wrench("ft_sensor", {1.0, 2.0, -3.0}, {0.1, -0.2, 0.3});
    const std::lock_guard lock(mutex);
    return !all.empty();
  }));
  sensor.publish_wrench("camera", {9.0, 9.0, 9.0}, {});
  sensor.publish_wrench("ft_sensor", {9.0, NAN, 9.0}, {});
  const core::Nanoseconds begin_ns = core::monotonic_ns();
  std::size_t before = 0;
  {
    const std::lock_guard lock(mutex);
    before = all.size();
  }
  for (int i = 0; i < 20'000; ++i) sensor.publish_wrench("ft_sensor", {1.0, 2.0, -3.0}, {0.1, -0.2, 0.3});
  EXPECT_TRUE(dds::eventually([&] {
    sensor.publish_wrench("ft_sensor", {4.0, 2.0, -3.0}, {0.1, -0.2, 0.3});
    const std::lock_guard lock(mutex);
    return all.back().force_N[0] == 4.0;
  }));
  const double took_s = core::seconds(core::monotonic_ns() - begin_ns);
  const std::lock_guard lock(mutex);
  EXPECT_LE(all.size() - before, static_cast<std::size_t>(took_s * 2000.0) + 20);
  for (const auto& wrench : all) {
    EXPECT_TRUE(wrench.force_N[0] == 1.0 || wrench.force_N[0] == 4.0);
    EXPECT_EQ(wrench.torque_Nm, (messages::Vector3{0.1, -0.2, 0.3}));
    EXPECT_TRUE(wrench.valid);
  }
}

TEST_F(Gateway, AnnouncesTypesByNameAndHash) {
  start(Graph::kSinceIron);
  ForeignNode tool(test_domain(), Distribution::kSinceIron);
  std::multimap<std::string, test::HeardEndpoint> all;
  ASSERT_TRUE(dds::eventually([&] {
    all = tool.endpoints();
    return all.count("rt/joint_states") == 2 && all.count("ros_discovery_info") == 2;
  }));
  const auto ours = [&](const std::string& topic) {
    for (auto [at, end] = all.equal_range(topic); at != end; ++at)
      if (!at->second.user_data.empty()) return at->second;
    return test::HeardEndpoint{};
  };
  EXPECT_EQ(ours("rt/joint_states").type, "sensor_msgs::msg::dds_::JointState_");
  EXPECT_EQ(ours("rt/joint_states").user_data,
            "typehash=RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e;");
  EXPECT_EQ(ours("ros_discovery_info").user_data,
            "typehash=RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e;");
  EXPECT_THAT(tool.participants(), testing::Contains("enclave=/;"));
}

// The pose of a frame in the world, from the transforms on the way: what tf2 computes.
Eigen::Vector3d origin_in_world(std::string frame,
                                const std::map<std::string, test::HeardTransform>& transforms) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int depth = 0; frame != "world" && depth < 20; ++depth) {
    const test::HeardTransform& t = transforms.at(frame);
    const Eigen::Vector4d q(t.rotation_xyzw[0], t.rotation_xyzw[1], t.rotation_xyzw[2], t.rotation_xyzw[3]);
    p = geometry::rotation_from_quaternion(q) * p +
        Eigen::Vector3d(t.translation[0], t.translation[1], t.translation[2]);
    frame = t.parent;
  }
  return p;
}

TEST_F(Gateway, SaysWhereTheArmIsInTheWordsOfRos2) {
  start(Graph::kNone);
  ForeignNode rviz(test_domain(), Distribution::kSinceIron);
  ASSERT_TRUE(dds::eventually([&] { return adapter_->robots() == 1; }));
  std::map<std::string, test::HeardTransform> all;
  std::vector<test::HeardJoints> joints;
  const auto listen = [&] {
    rviz.publish_joints({"elbow"}, {0.7}, {0.25}, core::utc_ns());
    adapter_->publish(false);
    all.merge(rviz.transforms("tf"));
    all.merge(rviz.transforms("tf_static"));
    joints = rviz.joints("phantom/joint_states");
    return all.contains("phantom/forearm") && all.contains("phantom/base") && !joints.empty();
  };
  ASSERT_TRUE(dds::eventually(listen));
  EXPECT_EQ(joints.back().name, std::vector<std::string>{"elbow"});
  EXPECT_EQ(joints.back().position, std::vector<double>{0.7});
  EXPECT_EQ(joints.back().velocity, std::vector<double>{0.25});
  EXPECT_LT(std::abs(core::seconds(core::utc_ns() - joints.back().stamp_ns)), 60.0);
  EXPECT_EQ(all.at("phantom/base").parent, "world");
  // The DH row's frame is the tip, 0.5 m along the turned x axis.
  const Eigen::Vector3d tip = origin_in_world("phantom/forearm", all);
  robot::LinkPoses X_WL;
  core::JointArray q{};
  q[0] = 0.7;
  arm_.link_poses(q, X_WL);
  const auto frame = arm_.find_frame("forearm");
  ASSERT_TRUE(frame.has_value());
  EXPECT_LT((tip - X_WL[frame->first] * frame->second.translation_m).norm(), 1e-12) << tip.transpose();
  EXPECT_THAT(rviz.texts("phantom/robot_description"),
              testing::AnyOf(testing::IsEmpty(), testing::Contains("<robot/>")));
  EXPECT_TRUE(dds::eventually([&] { return !rviz.texts("phantom/robot_description").empty(); })) << "latched";
}

// Tries ros2_gateway: wva_server does not answer for a collision object
TEST(CollisionObjects, ThatNobodyAnswersForAreRefusedOneByOne) {
  NodeOptions options{
      .domain = phantom::test::own_domain(1), .interfaces = {"127.0.0.1"}, .initial_peers = {"127.0.0.1"}};
  Node node(options);
  dds::Participant participant("objects_test", dds::test_network());
  ros2_gateway::CollisionObjects objects(participant, node, "collision_object", "world", 0.2);
  ForeignNode planner(options.domain, Distribution::kSinceIron);
  EXPECT_TRUE(dds::eventually([&] {
    planner.publish_sphere("ball", 0, {0.1, 0.2, 0.3}, 0.05);
    return objects.refused() >= 2;
  }));
  EXPECT_EQ(objects.done(), 0U);
}

class Graphs : public Gateway, public testing::WithParamInterface<Graph> {};

TEST_P(Graphs, NameTheNodeAndItsEndpoints) {
  start(GetParam());
  ForeignNode tool(test_domain(),
                   GetParam() == Graph::kHumble ? Distribution::kHumble : Distribution::kSinceIron);
  ASSERT_TRUE(dds::eventually([&] {
    const auto graph = tool.graph();
    return graph && graph->readers.size() == 3 && graph->writers.size() == 12;
  }));
  const test::HeardGraph graph = *tool.graph();
  EXPECT_EQ(graph.node, "phantom");
  EXPECT_EQ(graph.node_namespace, "/");
  const std::vector<std::string> topics{
      "rt/joint_states", "rt/phantom/joint_states", "rt/phantom/percept/worst_place", "rt/tf",
      "rt/tf_static",    "rt/diagnostics",          "rt/phantom/robot_description"};
  ASSERT_TRUE(dds::eventually([&] {
    const auto all = tool.endpoints();
    return std::all_of(topics.begin(), topics.end(), [&](const auto& topic) { return all.contains(topic); });
  }));
  std::vector<std::array<std::uint8_t, 16>> discovered;
  for (const auto& [topic, endpoint] : tool.endpoints()) discovered.push_back(endpoint.guid);
  for (const auto& writer : graph.writers) EXPECT_THAT(discovered, testing::Contains(writer));
  EXPECT_THAT(discovered, testing::Contains(graph.readers[0])) << "the graph names what discovery found";
  EXPECT_TRUE(
      std::equal(graph.participant.begin(), graph.participant.begin() + 12, graph.readers[0].begin()));
  const std::array<std::uint8_t, 4> participant_entity{0, 0, 1, 0xc1};
  EXPECT_TRUE(
      std::equal(participant_entity.begin(), participant_entity.end(), graph.participant.begin() + 12));
}

INSTANTIATE_TEST_SUITE_P(Of, Graphs, testing::Values(Graph::kHumble, Graph::kSinceIron),
                         [](const auto& test) { return test.param == Graph::kHumble ? "Humble" : "Iron"; });

// Hashes that are published (by rosidl, in the packages of Jazzy).
TEST(MessageTypes, HaveThePublishedHashes) {
  const std::vector<std::pair<const char*, const char*>> published{
      {"sensor_msgs::msg::dds_::JointState_",
       "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"},
      {"geometry_msgs::msg::dds_::WrenchStamped_",
       "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77"},
      {"geometry_msgs::msg::dds_::TwistStamped_",
       "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"},
      {"geometry_msgs::msg::dds_::PoseStamped_",
       "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"},
      {"sensor_msgs::msg::dds_::PointCloud2_",
       "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
      {"sensor_msgs::msg::dds_::CompressedImage_",
       "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"},
      {"sensor_msgs::msg::dds_::Joy_",
       "RIHS01_0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5"},
      {"visualization_msgs::msg::dds_::MarkerArray_",
       "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"},
      {"visualization_msgs::msg::dds_::Marker_",
       "RIHS01_45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0"},
      {"diagnostic_msgs::msg::dds_::DiagnosticArray_",
       "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
      {"tf2_msgs::msg::dds_::TFMessage_",
       "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"},
      {"std_msgs::msg::dds_::String_",
       "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
      {"shape_msgs::msg::dds_::Mesh_",
       "RIHS01_f2150b82d8ee7e8bc3f396a2b158aefb4b9a5510a474be271ba1268aebb55289"},
      {"rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
       "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"},
      {"sensor_msgs::msg::dds_::Image_",
       "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
      {"sensor_msgs::msg::dds_::CameraInfo_",
       "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"},
  };
  for (const auto& [name, hash] : published) {
    const MessageType* type = find_message_type(name);
    ASSERT_NE(type, nullptr) << name;
    EXPECT_STREQ(type->hash, hash) << name;
  }
  EXPECT_EQ(find_message_type("std_msgs::msg::dds_::Nothing_"), nullptr);
}

TEST(MessageTypes, AreDefinedAsMsgFilesDo) {
  EXPECT_STREQ(
      find_message_type("diagnostic_msgs::msg::dds_::DiagnosticStatus_")->definition,
      "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"
      "================================================================================\n"
      "MSG: diagnostic_msgs/KeyValue\nstring key\nstring value\n");
}

}  // namespace
}  // namespace phantom::ros2
