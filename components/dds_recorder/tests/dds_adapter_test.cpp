// Through DDS: what is written on topics stands in the queue as it was, and what is replayed comes out as it
// was.
#include "components/dds_recorder/adapter/dds_adapter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/observation/payload_writer.hpp"
#include "components/dds_recorder/adapter/dds_adapter_topics.hpp"

namespace phantom::dds_recorder {
namespace {

using dds::eventually;
using dds::test_network;
using testing::AllOf;
using testing::HasSubstr;

/// An adapter with all its topics open.
struct Heard {
  explicit Heard(const std::string& only = "")
      : adapter(
            test_network(), [only](const std::string& name) { return only.empty() || name == only; }, queue) {
    open();
  }
  void open() {
    for (TopicInfo& topic : adapter.new_topics()) {
      std::string why;
      EXPECT_TRUE(adapter.open(topic, static_cast<TopicNumber>(topics.size()), why)) << why;
      topics.push_back(std::move(topic));
    }
  }
  void take() {
    open();
    queue.drain(
        [this](const SampleView& sample) { got[topics[sample.head.topic].name].push_back(owned(sample)); });
  }
  SampleQueue queue{8'000'000};
  std::vector<TopicInfo> topics;
  std::map<std::string, std::vector<Sample>> got;
  DdsAdapter adapter;
};

TEST(DdsInput, GivesTheBytesOfEverySampleWithWriterNumberAndTimes) {
  Heard heard("hit_alert");
  core::NetworkOptions of_a_cell = test_network();
  of_a_cell.partition = "pair/b";
  dds::Participant there("phantom_sensing", of_a_cell);
  dds::Writer<msg::HitAlert> writer(there, dds::kHitAlert);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1; }));
  dds::Stamper stamper(there);
  std::vector<std::vector<std::uint8_t>> written;
  for (std::uint32_t i = 1; i <= 20; ++i) {
    msg::HitAlert alert;
    alert.stamp(stamper.next());
    alert.alert(i);
    alert.link_name("gripper");
    written.emplace_back();
    ASSERT_TRUE(dds::CdrCodec(dds::kHitAlert).encode(&alert, written.back()));
    ASSERT_TRUE(writer.write(alert));
  }
  ASSERT_TRUE(eventually([&] {
    heard.take();
    return heard.got["hit_alert"].size() >= 20;
  }));
  const auto& got = heard.got["hit_alert"];
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(got[i].bytes, written[i]) << "to the byte";
    EXPECT_EQ(got[i].head.sequence_number, i + 1);
    EXPECT_GT(got[i].head.received_ns, 0);
    EXPECT_LT(std::abs(got[i].head.source_utc_ns - core::utc_ns()), 60 * core::kNsPerSecond);
  }
  EXPECT_TRUE(
      eventually([&] { return heard.adapter.describe(got[0].head.writer).component == "phantom_sensing"; }));
  EXPECT_EQ(heard.adapter.describe(got[0].head.writer).partition, "pair/b");
  EventWatch watch({});
  EXPECT_THAT(watch.event_in(heard.topics[0], got[2].bytes).value_or(""), HasSubstr("hit alert 3 (gripper)"));
}

TEST(DdsInput, ALateRecorderGetsEveryDurableInstance) {
  dds::Participant there("wva_server", test_network());
  dds::Writer<msg::WorkspaceBrick> writer(there, dds::kWorkspaceBrick);
  msg::WorkspaceBrick brick;
  for (int version = 1; version <= 2; ++version) {
    for (int x = 0; x < 1500; ++x) {
      brick.bx(x);
      brick.version(static_cast<std::uint64_t>(version));
      brick.voxels_zstd(std::vector<std::uint8_t>(500, static_cast<std::uint8_t>(x)));
      ASSERT_TRUE(writer.write(brick));
    }
  }
  Heard heard("workspace_brick");
  EXPECT_TRUE(eventually([&] {
    heard.take();
    return heard.got["workspace_brick"].size() >= 1500;
  }));
  std::set<int> places;
  InstanceFinder finder;
  std::set<InstanceKey> instances;
  for (const Sample& sample : heard.got["workspace_brick"]) {
    ASSERT_TRUE(dds::decode(dds::kWorkspaceBrick, sample.bytes, brick));
    EXPECT_EQ(brick.version(), 2u);
    places.insert(brick.bx());
    InstanceKey key;
    EXPECT_TRUE(finder.find(heard.topics[0].type, sample.bytes, key));
    instances.insert(key);
  }
  EXPECT_EQ(places.size(), 1500u);
  EXPECT_EQ(instances.size(), 1500u);
}

TEST(DdsInput, ATopicOfSomebodyElsesTypeIsHeardOnceItIsDiscovered) {
  Heard heard("");
  dds::Participant there("stranger", test_network());
  diagnostics::EndpointQos qos;
  qos.reliability = diagnostics::Reliability::kReliable;
  observation::PayloadWriter writer(there, {"camera", "other::Image", false}, qos, 8);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 9, 8, 7, 6};
  EXPECT_TRUE(eventually([&] {
    writer.write(bytes);
    heard.take();
    return !heard.got["camera"].empty();
  }));
  EXPECT_EQ(heard.got["camera"].at(0).bytes, bytes);
  const auto& topic = heard.topics.back();
  EXPECT_EQ(topic.type, "other::Image");
  EXPECT_EQ(topic.schema_encoding, "") << "its description is not known";
}

// Tries dds_recorder: DDS refuses a reader
TEST(DdsInput, ATopicThatDdsRefusesIsNotHeardAndTheOthersAre) {
  Heard heard("camera");
  std::string why;
  const TopicInfo camera{.name = "camera", .type = "other::Image"};
  ASSERT_TRUE(heard.adapter.open(camera, 0, why)) << why;
  heard.topics = {camera};
  EXPECT_FALSE(heard.adapter.open({.name = "camera", .type = "another::Picture"}, 1, why));
  EXPECT_THAT(why, AllOf(HasSubstr("camera"), HasSubstr("another::Picture")));
  EXPECT_FALSE(heard.adapter.losses(1).any()) << "what is not heard loses nothing";
  dds::Participant there("stranger", test_network());
  observation::PayloadWriter writer(there, {"camera", "other::Image", false},
                                    {.reliability = diagnostics::Reliability::kReliable}, 8);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 9, 8, 7, 6};
  EXPECT_TRUE(eventually([&] {
    writer.write(bytes);
    heard.queue.drain([&](const SampleView& sample) { heard.got["camera"].push_back(owned(sample)); });
    return !heard.got["camera"].empty();
  }));
}

TEST(DdsOutput, WhatIsWrittenAsBytesReachesTypedReadersByInstance) {
  dds::Participant there("replay", test_network()), here("viewer", test_network());
  const dds::CdrCodec codec(dds::kWorkspaceObject);
  const TopicInfo info = topic_info(dds::kWorkspaceObject);
  EXPECT_TRUE(info.durable);
  EXPECT_TRUE(info.keyed);
  observation::PayloadWriter writer(
      there, {info.name, info.type, info.keyed}, writer_qos(info), history_depth(info),
      [&](auto bytes, auto& instance) { return codec.instance_of(bytes, instance); });
  for (std::uint16_t id = 1; id <= 50; ++id) {
    msg::WorkspaceObject object;
    object.id(id);
    object.name("object");
    object.mesh_hash(id);
    std::vector<std::uint8_t> bytes;
    ASSERT_TRUE(codec.encode(&object, bytes));
    ASSERT_TRUE(writer.write(bytes));
  }
  dds::Waiter waiter;
  std::map<int, std::uint64_t> got;  // a late joiner of a depth of one per instance
  dds::Reader<msg::WorkspaceObject> reader(here, dds::kWorkspaceObject,
                                           [&](const msg::WorkspaceObject& object, const dds::SampleInfo&) {
                                             waiter.change([&] { got[object.id()] = object.mesh_hash(); });
                                           });
  EXPECT_TRUE(waiter.wait([&] { return got.size() == 50; }));
}

TEST(Events, ComponentsThatBecomeDegradedAndEmergencyStopsAreEvents) {
  EventWatch watch({});
  const TopicInfo statuses = topic_info(dds::kComponentStatus), commands = topic_info(dds::kOperatorCommand);
  const auto status = [&](const char* component, msg::ComponentState state) {
    msg::ComponentStatus sample;
    sample.stamp().sequence_number(1);
    sample.component_name(component);
    sample.state(state);
    sample.message("because");
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(dds::CdrCodec(dds::kComponentStatus).encode(&sample, bytes));
    return watch.event_in(statuses, bytes).value_or("");
  };
  EXPECT_EQ(status("slave_io", msg::ComponentState::COMPONENT_RUNNING), "");
  EXPECT_EQ(status("slave_io", msg::ComponentState::COMPONENT_DEGRADED), "slave_io is degraded: because");
  EXPECT_EQ(status("slave_io", msg::ComponentState::COMPONENT_FAULT), "")
      << "one event, not one for each sample";
  EXPECT_EQ(status("slave_io", msg::ComponentState::COMPONENT_RUNNING), "");
  EXPECT_EQ(status("slave_io", msg::ComponentState::COMPONENT_FAULT), "slave_io is in fault: because");
  EXPECT_EQ(status("dds_recorder", msg::ComponentState::COMPONENT_DEGRADED), "") << "itself is none";
  std::uint64_t own_number = 0;
  const auto command = [&](msg::CommandKind kind, std::uint64_t session = 0, std::uint64_t number = 0) {
    msg::OperatorCommand sample;
    sample.stamp().session(session);
    sample.stamp().sequence_number(number != 0 ? number : ++own_number);
    sample.kind(kind);
    sample.issuer("me");
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(dds::CdrCodec(dds::kOperatorCommand).encode(&sample, bytes));
    return watch.event_in(commands, bytes).value_or("");
  };
  EXPECT_EQ(command(msg::CommandKind::COMMAND_MARK), "command, by me");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP), "emergency stop, by me");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_RESET), "");
  // Sent again until it is confirmed: one event, not twenty a second.
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP, 8, 3), "emergency stop, by me");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP, 9, 1), "emergency stop, by me")
      << "somebody else's";
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP, 8, 3), "");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_MARK, 8, 4), "command, by me");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP, 8, 3), "");
  EXPECT_EQ(command(msg::CommandKind::COMMAND_EMERGENCY_STOP, 8, 5), "emergency stop, by me");
  EXPECT_FALSE(watch.event_in(commands, std::vector<std::uint8_t>{1, 2, 3}));
}

}  // namespace
}  // namespace phantom::dds_recorder
