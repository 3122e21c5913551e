#include "components/dds_spy/echo.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace phantom::dds_spy {
namespace {

ReceivedSample note(core::Nanoseconds received_ns) {
  ReceivedSample sample;
  sample.topic = "note";
  sample.facts.received_ns = received_ns;
  sample.facts.sequence_number = 7;
  sample.facts.octets = 12;
  sample.content = nlohmann::ordered_json{{"x", 0.5}};
  return sample;
}

diagnostics::Graph graph_of(const std::string& type) {
  diagnostics::Graph graph;
  diagnostics::ParticipantInfo participant;
  participant.guid = diagnostics::participant_of({});
  participant.name = "acme";
  graph.put(participant);
  diagnostics::EndpointInfo writer;
  writer.writer = true;
  writer.type = type;
  graph.put(writer);
  return graph;
}

TEST(Echo, ShowsASampleAsTextAndAsJson) {
  const auto graph = graph_of("m::Note");
  EXPECT_EQ(Echo(false, 0, 0).take(note(1), graph), "--- note from acme, number 7, 12 octets\nx: 0.5\n");
  EXPECT_EQ(Echo(true, 0, 0).take(note(1), graph),
            "{\"topic\":\"note\",\"type\":\"m::Note\",\"writer\":\"acme\",\"number\":7,"
            "\"received_utc_ns\":0,\"source_utc_ns\":0,\"size\":12,\"sample\":{\"x\":0.5}}\n");
}

// Tries dds_spy: a payload that is cut … the type
TEST(Echo, ShowsOctetsOfWhatItCannotDecode) {
  ReceivedSample foreign = note(1), broken = note(1);
  foreign.content.reset();
  foreign.octets = broken.octets = "0001";
  broken.content.reset();
  broken.problem = "too short";
  const auto graph = graph_of("acme::Note");
  EXPECT_EQ(Echo(false, 0, 0).take(foreign, graph),
            "--- note from acme, number 7, 12 octets\ntype acme::Note is not the project's\noctets: 0001\n");
  EXPECT_EQ(Echo(false, 0, 0).take(broken, graph),
            "--- note from acme, number 7, 12 octets\ncannot be decoded: too short\noctets: 0001\n");
}

TEST(Echo, ThinsOutAndEnds) {
  const auto graph = graph_of("m::Note");
  Echo echo(false, 0.5, 2);
  EXPECT_TRUE(echo.take(note(0), graph));
  EXPECT_FALSE(echo.take(note(400 * core::kNsPerMillisecond), graph));
  ReceivedSample other = note(450 * core::kNsPerMillisecond);
  other.instance = "id=2";
  EXPECT_FALSE(echo.complete());
  EXPECT_TRUE(echo.take(other, graph)) << "each instance for itself";
  EXPECT_TRUE(echo.complete());
  EXPECT_FALSE(echo.take(note(core::kNsPerSecond), graph));
  EXPECT_EQ(echo.shown(), 2u);
}

}  // namespace
}  // namespace phantom::dds_spy
