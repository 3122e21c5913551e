// Recordings in ROS 2's words. tests/recording holds the same files with other people's readers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/recording/mcap_check.hpp"
#include "components/dds_recorder/adapter/dds_adapter_bag.hpp"
#include "components/dds_recorder/adapter/dds_adapter_export.hpp"
#include "components/dds_recorder/adapter/dds_adapter_topics.hpp"
#include "components/dds_recorder/convert.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::dds_recorder {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint64_t kBegin_ns = 1'700'000'000'000'000'000, kMs = 1'000'000;

/// A recording that the test writes, and the bag that is made of it.
class Exported : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder);
    sink = recording::FileSink::create(folder / "recording.mcap").value();
    writer.emplace(*sink, recording::WriterOptions{});
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  void record_bytes(const std::string& topic, const std::string& type, const recording::Bytes& bytes,
                    std::uint64_t ms, const recording::StringMap& qos = {}) {
    if (!channels.contains(topic)) {
      recording::StringMap about = qos;
      about["type"] = type;
      channels[topic] =
          writer->add_channel({.topic = topic, .message_encoding = "cdr", .metadata = about}).value();
    }
    ASSERT_TRUE(writer->write(recording::Message{.channel_id = channels[topic],
                                                 .log_time_ns = kBegin_ns + ms * kMs,
                                                 .publish_time_ns = kBegin_ns + ms * kMs - 1000,
                                                 .data = bytes}));
  }
  template <class T>
  void record(const dds::TopicSpec<T>& topic, const T& sample, std::uint64_t ms) {
    recording::Bytes bytes;
    ASSERT_TRUE(dds::CdrCodec(topic).encode(&sample, bytes));
    record_bytes(topic.name, topic.type_name, bytes, ms);
  }
  void record_state(double position, std::uint64_t ms, std::uint32_t joints = 1) {
    messages::SlaveState state;
    state.stamp.sequence_number = ms + 1;
    state.joint_count = joints;
    state.position[0] = position, state.velocity[0] = 0.25, state.loop_torque_Nm[0] = 3.0;
    record(dds::kSlaveState, messages::to_idl(state), ms);
  }
  void record_percept(double closeness, bool valid, std::uint64_t ms) {
    messages::Percept felt;
    felt.stamp.sequence_number = ms + 1;
    felt.valid = valid;
    if (!valid) felt.condition = messages::PerceptCondition::kStateStale;
    felt.closeness = closeness, felt.object = closeness > 0.0 ? 3 : 0, felt.joint_count = 1;
    felt.position_m = {0.1, 0.2, 0.3};
    record(dds::kPercept, messages::to_idl(felt), ms);
  }

  void run(ExportRequest request = {}) {
    ASSERT_TRUE(writer->finish());
    request.files = {folder / "recording.mcap"};
    request.out = folder / "bag.mcap";
    ASSERT_EQ(run_export(request, phantom::test::one_joint(), "<robot/>", notes), 0);
    EXPECT_TRUE(recording::check(request.out)->ok());
    bag.emplace(recording::McapReader::open(request.out).value());
  }
  /// Returns the messages of a topic in the bag.
  template <class PubSubType>
  std::vector<typename PubSubType::type> on(const std::string& topic) {
    const ros2::Topic<PubSubType> of_type("any", {});
    const dds::CdrCodec codec(of_type.spec());
    std::vector<typename PubSubType::type> all;
    recording::MessageCursor cursor(*bag);
    for (recording::Message message; cursor.next(message);) {
      const auto& channel = bag->channels().at(message.channel_id);
      if (channel.topic != topic) continue;
      times.push_back((message.log_time_ns - kBegin_ns) / kMs);
      EXPECT_TRUE(codec.decode(message.data, &all.emplace_back()));
      EXPECT_EQ(message.sequence, all.size());
    }
    return all;
  }
  recording::Channel channel(const std::string& topic) {
    for (const auto& [id, one] : bag->channels())
      if (one.topic == topic) return one;
    return {};
  }

  using Topics = ros2::FromPhantomTopics;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("dds_recorder_export_" + std::to_string(getpid()));
  std::unique_ptr<recording::FileSink> sink;
  std::optional<recording::McapWriter> writer;
  std::map<std::string, std::uint16_t> channels;
  std::ostringstream notes;
  std::optional<recording::McapReader> bag;
  std::vector<std::uint64_t> times;
};

TEST_F(Exported, EverySampleIsThereAtItsTimeWithItsValues) {
  record_state(0.5, 0);
  record_state(0.7, 1);
  record_percept(0.4, true, 2);
  record_percept(0.9, false, 3);
  run();
  const auto joints = on<Topics::JointState>("/phantom/joint_states");
  ASSERT_EQ(joints.size(), 2u);
  EXPECT_THAT(times, ElementsAre(0, 1));
  EXPECT_THAT(joints[1].name(), ElementsAre("elbow"));
  EXPECT_THAT(joints[1].position(), ElementsAre(0.7));
  EXPECT_THAT(joints[1].velocity(), ElementsAre(0.25));
  EXPECT_THAT(joints[1].effort(), ElementsAre(3.0));
  EXPECT_EQ(joints[1].header().stamp().sec(), 1'700'000'000);
  EXPECT_EQ(joints[1].header().stamp().nanosec(), 1'000'000u - 1000u) << "when it was sent";
  const auto closeness = on<Topics::Float64>("/phantom/percept/closeness");
  ASSERT_EQ(closeness.size(), 2u);
  EXPECT_EQ(closeness[0].data(), 0.4);
  EXPECT_TRUE(std::isnan(closeness[1].data()));
  EXPECT_EQ(on<Topics::JointState>("/phantom/percept/drag").size(), 1u);
  EXPECT_EQ(on<Topics::TfMessage>("/tf").size(), 2u);
  EXPECT_EQ(on<Topics::TfMessage>("/tf_static").size(), 1u);
  const auto wrenches =
      on<geometry_msgs::msg::dds_::WrenchStamped_PubSubType>("/phantom/percept/drag_wrench");
  ASSERT_EQ(wrenches.size(), 1u) << "of the valid percept, at the last pose";
  EXPECT_EQ(wrenches[0].header().frame_id(), "phantom/at_tool");
  EXPECT_EQ(bag->statistics().message_count, 14u);
}

TEST_F(Exported, ChannelsSayWhatRosbag2WantsToKnow) {
  record_state(0.5, 0);
  run();
  EXPECT_EQ(bag->header().profile, "ros2");
  const auto joints = channel("/phantom/joint_states");
  EXPECT_EQ(joints.message_encoding, "cdr");
  EXPECT_EQ(joints.metadata.at("topic_type_hash"),
            "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e");
  EXPECT_THAT(joints.metadata.at("offered_qos_profiles"),
              AllOf(HasSubstr("- history: 1\n  depth: 10\n  reliability: 1\n  durability: 2\n"),
                    HasSubstr("avoid_ros_namespace_conventions: false")));
  EXPECT_THAT(channel("/tf_static").metadata.at("offered_qos_profiles"), HasSubstr("durability: 1\n"));
  const auto& schema = bag->schemas().at(joints.schema_id);
  EXPECT_EQ(schema.name, "sensor_msgs/msg/JointState");
  EXPECT_EQ(schema.encoding, "ros2msg");
  EXPECT_THAT(std::string(schema.data.begin(), schema.data.end()), HasSubstr("MSG: std_msgs/Header\n"));
  const auto about = bag->metadata("rosbag2");
  ASSERT_EQ(about.size(), 1u);
  EXPECT_THAT(about[0].at("serialized_metadata"), AllOf(HasSubstr("version: 8\n"), HasSubstr("bag.mcap")));
}

// Tries dds_recorder: a sample that is none of the arm's, in an export
TEST_F(Exported, WhatIsNotOfThisArmIsLeftOutAndSaid) {
  record_state(0.5, 0, 7);
  record_state(9.0, 1);
  record_bytes("percept", "phantom::msg::Percept", {0, 1, 0, 0, 1, 2, 3}, 2);
  record_state(0.5, 3);
  run();
  EXPECT_EQ(on<Topics::JointState>("/phantom/joint_states").size(), 1u);
  EXPECT_THAT(notes.str(), AllOf(HasSubstr("slave_state: 2 samples left out"), HasSubstr("joint_count"),
                                 HasSubstr("percept: 1 samples left out: the bytes are not a sample")));
}

TEST_F(Exported, ARateAndARangeMakeItSmaller) {
  for (std::uint64_t ms = 0; ms < 1000; ++ms) record_state(0.001 * static_cast<double>(ms), ms);
  ExportRequest request;
  request.rate_Hz = 100.0;
  request.range = {0.5, 0.8};
  request.names = {.prefix = "robot", .frame_prefix = "r/", .world = "map"};
  run(request);
  const auto joints = on<Topics::JointState>("/robot/joint_states");
  ASSERT_EQ(joints.size(), 30u);
  EXPECT_EQ(joints[0].position()[0], 0.5);
  EXPECT_EQ(joints[29].position()[0], 0.79);
  EXPECT_EQ(joints[0].header().frame_id(), "r/base");
  EXPECT_EQ(on<Topics::TfMessage>("/tf_static").at(0).transforms().at(0).header().frame_id(), "map");
}

TEST_F(Exported, DiagnosticsComeOnceASecondAndSayWhoIsSilent) {
  messages::ComponentStatus status;
  status.stamp.sequence_number = 1;
  status.component = "slave_io", status.state = core::ComponentState::kRunning;
  for (const std::uint64_t ms : {0, 500, 1000}) record(dds::kComponentStatus, messages::to_idl(status), ms);
  record_state(0.5, 4500);
  run();
  const auto all = on<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType>("/diagnostics");
  ASSERT_EQ(all.size(), 4u);
  EXPECT_THAT(times, ElementsAre(1000, 2000, 3000, 4000));
  EXPECT_EQ(all[0].status().at(0).name(), "phantom: slave_io");
  EXPECT_EQ(all[1].status().at(0).level(), 0);
  EXPECT_EQ(all[3].status().at(0).level(), 3) << "stale";
}

TEST_F(Exported, MessagesOfARos2DomainStayAsTheyWere) {
  std_msgs::msg::dds_::String_ text;
  text.data("hello");
  const ros2::Topic<std_msgs::msg::dds_::String_PubSubType> of_type("chatter", {});
  recording::Bytes bytes;
  ASSERT_TRUE(dds::CdrCodec(of_type.spec()).encode(&text, bytes));
  const recording::StringMap latched{{"qos.durability", "transient local"},
                                     {"qos.reliability", "best effort"}};
  record_bytes("rt/chatter", of_type.spec().type_name, bytes, 0, latched);
  record_bytes("rt/unknown", "pkg::msg::dds_::Thing_", bytes, 1);
  record_bytes("chatter", of_type.spec().type_name, bytes, 2);
  record_state(0.5, 600);
  ExportRequest request;
  request.range.from_s = 0.5;
  run(request);
  const auto heard = on<std_msgs::msg::dds_::String_PubSubType>("/chatter");
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].data(), "hello");
  EXPECT_THAT(times, ElementsAre(500)) << "it was latched before the range";
  EXPECT_THAT(channel("/chatter").metadata.at("offered_qos_profiles"),
              HasSubstr("reliability: 2\n  durability: 1\n"));
  EXPECT_EQ(channel("/unknown").topic, "");
}

TEST_F(Exported, ARecordingOfARos2DomainHasItsDefinitionsAndIsDecoded) {
  const auto info =
      topic_info(diagnostics::EndpointInfo{.topic = "rt/tf", .type = "tf2_msgs::msg::dds_::TFMessage_"});
  EXPECT_EQ(info.schema_encoding, "ros2msg");
  EXPECT_THAT(info.schema, testing::StartsWith("geometry_msgs/TransformStamped[] transforms\n"));
  std_msgs::msg::dds_::String_ text;
  text.data("hello");
  const ros2::Topic<std_msgs::msg::dds_::String_PubSubType> of_type("chatter", {});
  recording::Bytes bytes;
  ASSERT_TRUE(dds::CdrCodec(of_type.spec()).encode(&text, bytes));
  record_bytes("rt/chatter", of_type.spec().type_name, bytes, 0);
  ASSERT_TRUE(writer->finish());
  ASSERT_EQ(run_convert({.files = {folder / "recording.mcap"}, .out = folder / "out.jsonl"}, notes), 0);
  std::ifstream lines(folder / "out.jsonl");
  std::string line;
  std::getline(lines, line);
  EXPECT_THAT(line, HasSubstr(R"("sample":{"data":"hello"})"));
}

TEST_F(Exported, NoFileIsLeftOfAnExportThatFails) {
  ASSERT_TRUE(writer->finish());
  const ExportRequest request{.files = {folder / "recording.mcap"}, .out = folder / "bag.bag"};
  EXPECT_THROW(run_export(request, phantom::test::one_joint(), "", notes), core::ConfigError);
  std::ofstream(folder / "there.mcap") << "mine";
  EXPECT_THROW(run_export({.files = request.files, .out = folder / "there.mcap"}, phantom::test::one_joint(),
                          "", notes),
               core::ConfigError);
  EXPECT_THROW(run_export({.files = request.files, .out = folder / "no/where.mcap"},
                          phantom::test::one_joint(), "", notes),
               std::runtime_error);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 2);
}

}  // namespace
}  // namespace phantom::dds_recorder
