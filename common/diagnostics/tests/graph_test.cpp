#include "common/diagnostics/graph.hpp"

#include <gtest/gtest.h>

namespace phantom::diagnostics {
namespace {

Guid guid(std::uint8_t participant, std::uint8_t entity) {
  Guid g{1, 15, 9, 9, 7, 7};
  g[11] = participant;
  g[14] = entity;
  g[15] = entity == 1 ? 0xc1 : 0x03;
  return g;
}

EndpointInfo end(std::uint8_t participant, std::uint8_t entity, bool writer, const std::string& topic,
                 const std::string& type = "T") {
  EndpointInfo info;
  info.guid = guid(participant, entity);
  info.writer = writer;
  info.topic = topic;
  info.type = type;
  return info;
}

ParticipantInfo member(std::uint8_t number, const std::string& name, const std::string& process) {
  ParticipantInfo info;
  info.guid = guid(number, 1);
  info.name = name;
  info.process = process;
  return info;
}

TEST(Graph, AParticipantGoesWithItsEndpoints) {
  Graph graph;
  graph.put(member(1, "slave_io", "42"));
  graph.put(member(2, "viewer", ""));
  graph.put(end(1, 2, true, "slave_state"));
  graph.put(end(2, 2, false, "slave_state"));
  EXPECT_EQ(graph.who(guid(1, 2)), "slave_io (process 42)");
  EXPECT_EQ(graph.who(guid(2, 2)), "viewer");
  graph.remove(guid(1, 1));
  EXPECT_EQ(graph.participants().size(), 1u);
  ASSERT_EQ(graph.endpoints().size(), 1u);
  EXPECT_EQ(graph.endpoints().begin()->first, guid(2, 2));
  EXPECT_EQ(graph.who(guid(1, 2)), "01.0f.09.09.07.07.00.00.00.00.00.01|00.00.01.c1");
  graph.remove(guid(2, 2));
  EXPECT_TRUE(graph.endpoints().empty());
}

TEST(Graph, NodesNameTheirEndpointsUntilTheirParticipantGoes) {
  Graph graph;
  graph.put_nodes(guid(1, 1), {{"/early", {}}});
  EXPECT_TRUE(graph.nodes(guid(1, 1)).empty()) << "nobody is known there";
  graph.put(member(1, "/", "42"));
  graph.put_nodes(guid(1, 1), {{"/talker", {guid(1, 2)}}, {"/listener", {guid(1, 3)}}});
  EXPECT_EQ(graph.name(guid(1, 3)), "/listener");
  EXPECT_EQ(graph.who(guid(1, 2)), "/talker (process 42)");
  EXPECT_EQ(graph.who(guid(1, 4)), "/ (process 42)") << "none of its nodes'";
  graph.put_nodes(guid(1, 1), std::vector<NodeInfo>(1000));
  EXPECT_EQ(graph.nodes(guid(1, 2)).size(), Graph::kMaxNodes);
  graph.remove(guid(1, 1));
  EXPECT_TRUE(graph.nodes(guid(1, 1)).empty());
}

// Tries dds_spy: with different types
TEST(Graph, OnlyEndsOfOneTopicCanDisagree) {
  Graph graph;
  graph.put(end(1, 2, true, "a"));
  graph.put(end(2, 2, false, "b", "Other"));
  EXPECT_TRUE(graph.disagreements().empty());
  graph.put(end(2, 3, false, "a", "Other"));
  const auto found = graph.disagreements();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].reasons.at(0).policy, "type");
  EXPECT_EQ(found[0].reasons.at(0).offered, "T");
  EXPECT_EQ(found[0].reasons.at(0).requested, "Other");
}

TEST(Graph, CellsThatArePartitionedDoNotDisagreeButALonelyEndDoes) {
  const auto in = [](std::uint8_t who, std::uint8_t number, bool writer, const char* partition) {
    auto made = end(who, number, writer, "a");
    made.qos.partitions = {partition};
    return made;
  };
  Graph graph;
  graph.put(in(1, 2, true, "cell_1"));
  graph.put(in(1, 3, false, "cell_1"));
  graph.put(in(2, 2, true, "cell_2"));
  graph.put(in(2, 3, false, "cell_2"));
  EXPECT_TRUE(graph.disagreements().empty());
  graph.put(in(2, 4, false, "cell2"));  // mistyped: nobody writes there
  const auto found = graph.disagreements();
  ASSERT_EQ(found.size(), 2u) << "told against each writer that it might mean";
  for (const auto& pair : found) {
    EXPECT_EQ(pair.reader->guid, guid(2, 4));
    EXPECT_EQ(pair.reasons.at(0).policy, "partition");
  }
}

// Tries dds_spy: with different keys
TEST(Graph, AKeyAtOneEndOnlyIsADisagreement) {
  auto reader = end(2, 2, false, "a");
  reader.keyed = true;
  EXPECT_EQ(mismatches(end(1, 2, true, "a"), reader).at(0).policy, "key");
}

TEST(Guid, NamesHostAndParticipant) {
  EXPECT_TRUE(same_host(guid(1, 2), guid(2, 3)));
  Guid elsewhere = guid(1, 2);
  elsewhere[3] = 1;
  EXPECT_FALSE(same_host(guid(1, 2), elsewhere));
  EXPECT_EQ(participant_of(guid(3, 2)), guid(3, 1));
}

TEST(Graph, DisagreementsAreFoundUpToANumber) {
  Graph graph;
  for (std::uint8_t i = 0; i < 200; ++i) {
    graph.put(end(1, i, true, "a"));
    graph.put(end(2, i, false, "a", "Other"));
  }
  EXPECT_EQ(graph.disagreements().size(), Graph::kMaxDisagreements);
}

TEST(Graph, AParticipantThatWasNeverPutTakesItsEndpointsAlong) {
  Graph graph;
  graph.put(end(1, 2, true, "a"));
  graph.put(end(2, 2, true, "a"));
  graph.remove(guid(1, 1));
  ASSERT_EQ(graph.endpoints().size(), 1u);
  EXPECT_EQ(graph.endpoints().begin()->first, guid(2, 2));
}

}  // namespace
}  // namespace phantom::diagnostics
