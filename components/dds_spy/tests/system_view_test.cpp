#include "components/dds_spy/system_view.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "components/dds_spy/reports.hpp"

namespace phantom::dds_spy::system_view_test {
namespace {

using diagnostics::EndpointInfo;
using diagnostics::Guid;
using diagnostics::ParticipantInfo;
using Change = diagnostics::Presence;

constexpr core::Nanoseconds kUtc = 1'700'000'000 * core::kNsPerSecond;

Guid guid(std::uint8_t participant, std::uint8_t entity) {
  Guid g{1, 15, 9, 9, 7, 7};
  g[11] = participant;
  g[14] = entity;
  g[15] = entity == 1 ? 0xc1 : 0x03;
  return g;
}

ParticipantInfo participant(std::uint8_t number, const std::string& name) {
  ParticipantInfo info;
  info.guid = guid(number, 1);
  info.name = name;
  info.process = std::to_string(1000 + number);
  info.host = "desk";
  info.machine = "desk:77";
  info.vendor = "Fast DDS";
  info.lease_ns = 5'000 * core::kNsPerMillisecond;
  return info;
}

EndpointInfo slave_end(std::uint8_t number, std::uint8_t entity, bool writer) {
  EndpointInfo info;
  info.guid = guid(number, entity);
  info.writer = writer;
  info.topic = "slave_state";
  info.type = "phantom::msg::SlaveState";
  info.qos = contracts().at("slave_state").qos;
  return info;
}

ReceivedSample sample(std::uint64_t number, core::Nanoseconds received_ns, core::Nanoseconds made_ns) {
  ReceivedSample received;
  received.topic = "slave_state";
  received.writer = guid(1, 2);
  received.facts.sequence_number = number;
  received.facts.received_ns = received_ns;
  received.facts.received_utc_ns = kUtc + received_ns;
  received.facts.octets = 660;
  received.facts.stamp = SampleStamp{number, made_ns, 0, 5};
  received.facts.same_host = true;
  return received;
}

struct SystemViewTest : testing::Test {
  SystemViewTest() {
    view.on_participant(participant(1, "slave_io"), Change::kAppeared, kUtc);
    view.on_participant(participant(2, "master_io"), Change::kAppeared, kUtc);
    view.on_endpoint(slave_end(1, 2, true), Change::kAppeared, kUtc);
    reported.clear();
  }

  std::string all() const {
    std::string text;
    for (const Event& event : reported)
      text +=
          std::string(name_of(event.kind)) + " " + event.topic + " " + event.who + ": " + event.text + "\n";
    return text;
  }
  ReportInput input() const { return {view, contracts(), every_topic, 42, 2.0}; }

  std::vector<Event> reported;
  diagnostics::NameFilter every_topic;
  SystemView view{100, 0.0, [this](const Event& event) { reported.push_back(event); }};
};

TEST_F(SystemViewTest, ALateSampleSaysWhetherTheWriterWasLate) {
  view.on_sample(sample(1, 1000 * core::kNsPerMillisecond, 999 * core::kNsPerMillisecond));
  view.on_sample(sample(2, 1030 * core::kNsPerMillisecond, 1029 * core::kNsPerMillisecond));
  view.on_sample(sample(3, 1070 * core::kNsPerMillisecond, 1030 * core::kNsPerMillisecond));
  EXPECT_EQ(all(),
            "deadline_missed slave_state slave_io (process 1001): "
            "30.0 ms between two samples (deadline offered: 20 ms); they were made 30.0 ms apart: "
            "the writer was late\n"
            "deadline_missed slave_state slave_io (process 1001): "
            "40.0 ms between two samples (deadline offered: 20 ms); they were made 1.0 ms apart: "
            "held up on the way or in this process\n");
  EXPECT_EQ(view.writers().begin()->second.deadlines_missed, 3u);
}

TEST_F(SystemViewTest, ASilenceIsToldWhileItLasts) {
  view.on_sample(sample(1, 1000 * core::kNsPerMillisecond, 1000 * core::kNsPerMillisecond));
  view.look(1010 * core::kNsPerMillisecond, kUtc);
  EXPECT_TRUE(reported.empty());
  view.look(1500 * core::kNsPerMillisecond, kUtc);
  view.look(1600 * core::kNsPerMillisecond, kUtc);
  EXPECT_EQ(all(),
            "deadline_missed slave_state slave_io (process 1001): nothing for 500.0 ms (deadline offered: "
            "20 ms)\n");
  view.on_sample(sample(2, 2000 * core::kNsPerMillisecond, 2000 * core::kNsPerMillisecond));
  EXPECT_EQ(reported.back().kind, EventKind::kDeadlineMet);
}

TEST_F(SystemViewTest, GapsSkipsAndRestartsAreTold) {
  view.on_sample(sample(1, 1 * core::kNsPerMillisecond, 1 * core::kNsPerMillisecond));
  view.on_sample(sample(5, 2 * core::kNsPerMillisecond, 2 * core::kNsPerMillisecond));
  auto skipping = sample(6, 3 * core::kNsPerMillisecond, 3 * core::kNsPerMillisecond);
  skipping.facts.stamp->sequence_number = 8;
  view.on_sample(skipping);
  auto restarted = sample(7, 4 * core::kNsPerMillisecond, 4 * core::kNsPerMillisecond);
  restarted.facts.stamp->session = 0xab;
  view.on_sample(restarted);
  EXPECT_EQ(all(),
            "gap slave_state slave_io (process 1001): 3 samples did not come before number 5\n"
            "skip slave_state slave_io (process 1001): the writer left out 2 numbers of its stamp before 8\n"
            "restart slave_state slave_io (process 1001): "
            "a new session of the writer's process, 00000000000000ab\n");
}

// Tries dds_spy: a writer with weaker QoS joins
TEST_F(SystemViewTest, ANewReaderOfTheSpyMakesNoGap) {
  view.on_sample(sample(1, 1 * core::kNsPerMillisecond, 1 * core::kNsPerMillisecond));
  view.on_reader_made("slave_state");
  view.on_sample(sample(90, 900 * core::kNsPerMillisecond, 900 * core::kNsPerMillisecond));
  EXPECT_TRUE(reported.empty()) << all();
}

TEST_F(SystemViewTest, LivelinessIsToldWithItsLease) {
  view.on_liveliness(guid(1, 2), true, kUtc);
  EXPECT_TRUE(reported.empty()) << "alive is what it was";
  view.on_liveliness(guid(1, 2), false, kUtc);
  view.on_liveliness(guid(1, 2), true, kUtc);
  ASSERT_EQ(reported.size(), 2u);
  EXPECT_EQ(reported[0].text,
            "no proof of life for the lease of 200 ms (manual by topic): "
            "the writer hangs, was killed or is cut off");
  EXPECT_EQ(reported[1].kind, EventKind::kLivelinessBack);
}

TEST_F(SystemViewTest, AMismatchIsToldOnceAndAgainAfterItWasGone) {
  auto reader = slave_end(2, 2, false);
  reader.qos.deadline_ns = 5 * core::kNsPerMillisecond;
  view.on_endpoint(reader, Change::kAppeared, kUtc);
  view.on_endpoint(slave_end(2, 3, false), Change::kAppeared, kUtc);
  const auto mismatches = [&] {
    view.look(0, kUtc);
    return view.events().totals().contains(EventKind::kQosMismatch)
               ? view.events().totals().at(EventKind::kQosMismatch)
               : 0;
  };
  EXPECT_EQ(mismatches(), 1u);
  EXPECT_NE(all().find("qos_mismatch slave_state slave_io (process 1001) → master_io (process 1002): "
                       "do not communicate: deadline, offered 20 ms, requested 5 ms; see dds_spy qos"),
            std::string::npos)
      << all();
  view.on_endpoint(reader, Change::kLeft, kUtc);
  EXPECT_EQ(mismatches(), 1u);
  view.on_endpoint(reader, Change::kAppeared, kUtc);
  EXPECT_EQ(mismatches(), 2u);
}

TEST_F(SystemViewTest, AParticipantThatIsLostIsToldFromOneThatLeft) {
  view.on_participant(participant(1, "slave_io"), Change::kLost, kUtc);
  view.on_participant(participant(2, "master_io"), Change::kLeft, kUtc);
  EXPECT_EQ(
      all(),
      "participant_lost  slave_io (process 1001): silent for its lease of 5 s: killed, frozen or cut off\n"
      "participant_left  master_io (process 1002): left\n");
  EXPECT_TRUE(view.graph().endpoints().empty());
}

// Tries dds_spy: a payload that is cut … the type
TEST_F(SystemViewTest, WhatCannotBeDecodedIsCountedAndTold) {
  auto bad = sample(1, 1 * core::kNsPerMillisecond, 0);
  bad.problem = "phantom::msg::SlaveState.state: needs 4 octets at 72, 0 are left";
  view.on_sample(bad);
  EXPECT_EQ(view.writers().begin()->second.undecodable, 1u);
  EXPECT_EQ(reported.back().kind, EventKind::kUndecodable);
}

TEST_F(SystemViewTest, ReportsInJsonAndTextSayTheSame) {
  auto reader = slave_end(2, 2, false);
  reader.qos.reliability = diagnostics::Reliability::kReliable;
  view.on_endpoint(reader, Change::kAppeared, kUtc);
  EndpointInfo foreign = slave_end(1, 4, true);
  foreign.topic = "acme";
  foreign.type = "acme::Note";
  view.on_endpoint(foreign, Change::kAppeared, kUtc);
  for (std::uint64_t i = 1; i <= 11; ++i)
    view.on_sample(sample(i, static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond,
                          static_cast<core::Nanoseconds>(i) * core::kNsPerMillisecond - 50'000));

  const auto topology = topology_json(input());
  EXPECT_EQ(topology["participants"].size(), 2u);
  EXPECT_EQ(topology["participants"][0]["process"], "1001");
  EXPECT_EQ(topology["topics"][0]["name"], "acme");
  EXPECT_EQ(topology["topics"][0]["foreign"], true);
  EXPECT_EQ(topology["topics"][1]["foreign"], false);
  EXPECT_EQ(topology["mismatches"], 1);
  const auto text = topology_text(input());
  EXPECT_EQ(text.substr(0, text.find('\n')),
            "domain 42: 2 participants on 1 host, 2 topics, 2 writers, 1 reader");
  EXPECT_NE(text.find("\nhost desk\n"), std::string::npos);
  EXPECT_NE(text.find("acme::Note (foreign)"), std::string::npos);
  EXPECT_NE(text.find("1 pair of writers and readers do not communicate: dds_spy qos says why."),
            std::string::npos);

  const auto qos = qos_json(input());
  ASSERT_EQ(qos["mismatches"].size(), 1u);
  EXPECT_EQ(qos["mismatches"][0]["reasons"][0]["policy"], "reliability");
  EXPECT_NE(qos_text(input()).find("reliability: offered best effort, requested reliable\n"),
            std::string::npos);
  EXPECT_NE(qos_text(input()).find("departs from the contract: reliability reliable (contract: best effort)"),
            std::string::npos);

  const auto rates = rates_json(input());
  ASSERT_EQ(rates["streams"].size(), 1u);
  EXPECT_NEAR(rates["streams"][0]["rate_hz"].get<double>(), 1000.0, 1e-6);
  EXPECT_EQ(rates["silent"].dump(), R"(["acme"])");
  EXPECT_NE(rates_text(input()).find("1000.00"), std::string::npos);
  EXPECT_NE(rates_text(input()).find("nothing came on: acme\n"), std::string::npos);

  const auto latency = latency_json(input());
  EXPECT_EQ(latency["streams"][0]["clock"], "monotonic");
  EXPECT_NEAR(latency["streams"][0]["latency_s"]["mean"].get<double>(), 50e-6, 1e-12);
  EXPECT_NE(latency_text(input()).find("monotonic"), std::string::npos);
}

TEST_F(SystemViewTest, FiltersNarrowReports) {
  view.on_sample(sample(1, 1 * core::kNsPerMillisecond, 0));
  const diagnostics::NameFilter others({"!slave_*"});
  const ReportInput narrowed{view, contracts(), others, 42, 2.0};
  EXPECT_TRUE(rates_json(narrowed)["streams"].empty());
  EXPECT_TRUE(topology_json(narrowed)["topics"].empty());
  EXPECT_TRUE(qos_json(narrowed)["endpoints"].empty());
}

TEST_F(SystemViewTest, CountsCanBeSetToZero) {
  view.on_sample(sample(1, 1 * core::kNsPerMillisecond, 0));
  view.reset_counts();
  EXPECT_EQ(view.writers().begin()->second.stream.figures().samples, 0u);
  EXPECT_EQ(view.graph().participants().size(), 2u);
}

TEST_F(SystemViewTest, InstancesOfAWriterAreToldApartUpToANumber) {
  for (std::uint64_t i = 0; i < 3 * ObservedWriter::kMaxInstances; ++i) {
    ReceivedSample received = sample(i + 1, 1'000'000 * static_cast<core::Nanoseconds>(i), 0);
    received.instance = "id=" + std::to_string(i);
    view.on_sample(received);
  }
  const ObservedWriter& writer = view.writers().at(guid(1, 2));
  EXPECT_EQ(writer.instances.size(), ObservedWriter::kMaxInstances + 1);
  EXPECT_EQ(writer.instances.at(ObservedWriter::kOthers), 2 * ObservedWriter::kMaxInstances);
  EXPECT_LE(writer.deadlines.size(), ObservedWriter::kMaxInstances);
}

Guid numbered(std::size_t participant, std::uint8_t entity) {
  Guid g = guid(0, entity);
  g[8] = 77;
  g[9] = static_cast<std::uint8_t>(participant >> 16);
  g[10] = static_cast<std::uint8_t>(participant >> 8);
  g[11] = static_cast<std::uint8_t>(participant);
  return g;
}

TEST_F(SystemViewTest, OfAllWritersTogetherInstancesAreToldApartUpToANumber) {
  constexpr std::size_t kEach = 4000, kWriters = 2 * SystemView::kMaxInstances / kEach;
  std::size_t kept = 0, counted = 0;
  for (std::size_t w = 0; w < kWriters; ++w) {
    ReceivedSample received = sample(1, 1, 0);
    received.writer = numbered(w, 2);
    for (std::size_t i = 0; i < kEach; ++i) {
      received.instance = "id=" + std::to_string(i);
      ++received.facts.sequence_number;
      view.on_sample(received);
    }
  }
  for (const auto& [guid, writer] : view.writers()) {
    kept += writer.instances.size();
    for (const auto& [instance, samples] : writer.instances) counted += samples;
  }
  EXPECT_LE(kept, SystemView::kMaxInstances + 2 * kWriters) << "besides, one and all others for each";
  EXPECT_EQ(counted, kWriters * kEach) << "all are counted";
  view.reset_counts();
  ReceivedSample again = sample(1, 1, 0);
  again.writer = numbered(kWriters - 1, 2);
  for (const char* instance : {"id=1", "id=2"}) {
    again.instance = instance;
    view.on_sample(again);
  }
  EXPECT_EQ(view.writers().at(again.writer).instances.size(), 2u) << "there is room again";
}

TEST_F(SystemViewTest, SoManyWritersAreMeasuredAndThoseThatWentMakeRoom) {
  auto end = slave_end(1, 2, true);
  const auto come = [&](std::size_t number) {
    end.guid = numbered(number, 2);
    view.on_endpoint(end, Change::kAppeared, kUtc);
    ReceivedSample received = sample(1, 1, 0);
    received.writer = end.guid;
    view.on_sample(received);
  };
  for (std::size_t number = 0; number < SystemView::kMaxWriters + 100; ++number) come(number);
  EXPECT_EQ(view.writers().size(), SystemView::kMaxWriters);
  EXPECT_EQ(view.samples_left_out(), 100u);
  for (std::size_t number = 0; number < 10; ++number) {
    end.guid = numbered(number, 2);
    view.on_endpoint(end, Change::kLeft, kUtc);
    ReceivedSample late = sample(2, 2, 0);
    late.writer = end.guid;
    view.on_sample(late);  // it came before its writer's end and is taken after it
  }
  come(SystemView::kMaxWriters + 200);
  EXPECT_TRUE(view.writers().contains(numbered(SystemView::kMaxWriters + 200, 2)));
  EXPECT_LE(view.writers().size(), SystemView::kMaxWriters);
}

TEST_F(SystemViewTest, EndpointsThatAreAnnouncedBeforeTheirParticipantGoWithIt) {
  auto end = slave_end(9, 2, true);
  view.on_endpoint(end, Change::kAppeared, kUtc);
  const std::size_t before = view.graph().endpoints().size();
  view.on_participant(participant(9, "never announced"), Change::kLost, kUtc);
  EXPECT_EQ(view.graph().endpoints().size(), before - 1);
}

}  // namespace
}  // namespace phantom::dds_spy::system_view_test
