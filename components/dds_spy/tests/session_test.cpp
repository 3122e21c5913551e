// The spy in a domain of its own, with real writers and readers, over UDP on loopback.
#include "components/dds_spy/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <future>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <utility>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/observation/payload_writer.hpp"
#include "common/ros2/endpoint.hpp"
#include "common/ros2/message_types.hpp"
#include "common/runtime/process/process.hpp"
#include "components/dds_spy/reports.hpp"
#include "fast_dds/participants.hpp"
#include "fast_dds/test_transport.hpp"
#include "ros2_idl/std_msgsPubSubTypes.hpp"

namespace phantom::dds_spy {
namespace {

using testing::HasSubstr;
namespace edds = eprosima::fastdds::dds;

/// Repeats something in a thread of its own while it lives.
class Repeating {
 public:
  explicit Repeating(std::function<void()> what,
                     std::chrono::microseconds period = std::chrono::milliseconds(2))
      : thread_([what = std::move(what), period](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            what();
            std::this_thread::sleep_for(period);
          }
        }) {}

 private:
  std::jthread thread_;
};

/// The spy without its command line: what it found is looked at until it is as it should be.
struct Spy {
  explicit Spy(const Reading& reading = {}) : adapter(dds::test_network(), reading, view) {}

  bool reports(EventKind kind, const std::string& topic, const std::string& part) {
    return dds::eventually([&] {
      adapter.follow_writers();
      const auto lock = adapter.lock();
      view.look(core::monotonic_ns(), core::utc_ns());
      const auto& newest = view.events().newest();
      return std::any_of(newest.begin(), newest.end(), [&](const Event& event) {
        return event.kind == kind && event.topic == topic &&
               (event.who + ": " + event.text).find(part) != std::string::npos;
      });
    });
  }
  std::uint64_t samples(const std::string& topic) {
    adapter.follow_writers();
    const auto lock = adapter.lock();
    std::uint64_t sum = 0;
    for (const auto& [guid, writer] : view.writers())
      sum += writer.topic == topic ? writer.stream.figures().samples : 0;
    return sum;
  }
  bool receives(const std::string& topic, std::uint64_t count = 3) {
    return dds::eventually([&] { return samples(topic) >= count; });
  }

  SystemView view{1000, 0.0, {}};
  DdsAdapter adapter;
};

struct SlaveWriter {
  explicit SlaveWriter(dds::Participant& participant)
      : stamper(participant), writer(participant, dds::kSlaveState) {}
  void write() {
    msg::SlaveState state;
    state.stamp(stamper.next());
    writer.write(state);
  }
  dds::Stamper stamper;
  dds::Writer<msg::SlaveState> writer;
};

class Ros2Nodes : public testing::TestWithParam<ros2::Graph> {};

TEST_P(Ros2Nodes, AreNamedAndTheirMessagesDecoded) {
  const auto network = dds::test_network();
  ros2::Node node(
      {.name = "talker", .domain = network.domain, .interfaces = network.interfaces, .graph = GetParam()});
  ros2::Publisher<std_msgs::msg::dds_::String_PubSubType> out(node, "chatter", ros2::kDefault);
  std::string said, graph;
  SystemView view(1000, 0.0, {});
  DdsAdapter adapter(network, {}, view, [&](const ReceivedSample& sample) {
    EXPECT_EQ(sample.problem, "");
    if (sample.content) (sample.topic == "rt/chatter" ? said : graph) = sample.content->dump();
  });
  const ReportInput input{view, contracts(), diagnostics::NameFilter()};
  const auto shown = [&] {
    std_msgs::msg::dds_::String_ text;
    text.data("hello");
    out.publish(text);
    adapter.follow_writers();
    const auto lock = adapter.lock();
    return said == R"({"data":"hello"})" && topology_text(input).find("nodes /talker") != std::string::npos;
  };
  EXPECT_TRUE(dds::eventually(shown)) << said;
  const auto lock = adapter.lock();
  EXPECT_THAT(topology_text(input), HasSubstr("std_msgs/msg/String (ROS 2) "));
  EXPECT_THAT(graph, HasSubstr(R"("node_name":"talker")"));
  const auto json = topology_json(input);
  for (const auto& topic : json["topics"]) {
    if (topic["name"] != "rt/chatter") continue;
    EXPECT_EQ(topic["ros2"]["topic"], "/chatter");
    EXPECT_EQ(topic["ros2"]["type"], "std_msgs/msg/String");
    EXPECT_EQ(topic["writers"][0]["type_hash"],
              ros2::find_message_type(topic["types"][0].get<std::string>())->hash);
    EXPECT_THAT(topic["writers"][0]["participant"].get<std::string>(), testing::StartsWith("/talker"));
  }
}

// What reads nothing but discovery names nodes all the same.
TEST_P(Ros2Nodes, AreNamedWithoutReadingTopics) {
  const auto network = dds::test_network();
  ros2::Node node(
      {.name = "talker", .domain = network.domain, .interfaces = network.interfaces, .graph = GetParam()});
  Spy spy({.read_topics = false});
  EXPECT_TRUE(dds::eventually([&] {
    spy.adapter.follow_writers();
    const auto lock = spy.adapter.lock();
    for (const auto& [guid, participant] : spy.view.graph().participants())
      if (!spy.view.graph().nodes(guid).empty()) return true;
    return false;
  }));
  EXPECT_EQ(spy.samples("ros_discovery_info"), 0u);
}

INSTANTIATE_TEST_SUITE_P(Of, Ros2Nodes, testing::Values(ros2::Graph::kHumble, ros2::Graph::kSinceIron),
                         [](const auto& test) {
                           return test.param == ros2::Graph::kHumble ? "Humble" : "Iron";
                         });

TEST(Spy, SeesRateLatencyASkipAMissedDeadlineAndLostLiveliness) {
  dds::Participant there("slave_io", dds::test_network());
  SlaveWriter slave(there);
  Spy spy;
  ASSERT_TRUE(dds::eventually([&] {
    slave.write();
    return spy.samples("slave_state") >= 20;
  }));
  {
    const auto lock = spy.adapter.lock();
    const auto figures = spy.view.writers().begin()->second.stream.figures();
    EXPECT_GT(figures.rate_hz, 0.0);
    EXPECT_EQ(figures.clock, LatencyClock::kMonotonic);
    EXPECT_GT(figures.latency_min_s, 0.0);
    EXPECT_EQ(figures.negative_latencies, 0u);
    EXPECT_EQ(figures.skipped, 0u);
  }
  slave.stamper.next();
  slave.stamper.next();
  slave.write();
  EXPECT_TRUE(spy.reports(EventKind::kSkip, "slave_state",
                          "slave_io (process " + std::to_string(getpid()) + "): the writer left out"));
  // Nothing more is written: first the deadline of 20 ms passes, then the lease of 200 ms.
  EXPECT_TRUE(spy.reports(EventKind::kDeadlineMissed, "slave_state", "(deadline offered: 20 ms)"));
  EXPECT_TRUE(spy.reports(EventKind::kLivelinessLost, "slave_state", "lease of 200 ms"));
  slave.write();
  EXPECT_TRUE(spy.reports(EventKind::kDeadlineMet, "slave_state", "samples come again"));
  EXPECT_TRUE(spy.reports(EventKind::kLivelinessBack, "slave_state", "proves again"));
}

/// A writer whose packets can be made to vanish on their way.
class LossyWriter {
 public:
  LossyWriter() {
    auto transport = std::make_shared<fast_dds::rtps::test_UDPv4TransportDescriptor>();
    transport->interfaceWhiteList = {"127.0.0.1"};
    transport->drop_data_messages_filter_ = [this](fast_dds::rtps::CDRMessage_t& message) {
      constexpr std::uint32_t kWriterEntity = 8;  // after flags, octets to inline QoS and the reader's entity
      const bool builtin = (message.buffer[message.pos + kWriterEntity + 3] & 0xc0) == 0xc0;
      return !builtin && dropping;
    };
    fast_dds::deliver_by_transport();  // what is delivered by call cannot be dropped
    edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
    qos.name("lossy");
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    auto* factory = edds::DomainParticipantFactory::get_instance();
    participant_ =
        factory->create_participant(static_cast<edds::DomainId_t>(dds::test_network().domain), qos);
    const auto type = dds::kPercept.make_type();
    type.register_type(participant_, dds::kPercept.type_name);
    auto* topic = participant_->create_topic("percept", dds::kPercept.type_name, edds::TOPIC_QOS_DEFAULT);
    edds::DataWriterQos writer_qos = edds::DATAWRITER_QOS_DEFAULT;
    writer_qos.reliability().kind = edds::BEST_EFFORT_RELIABILITY_QOS;
    writer_qos.data_sharing().off();
    writer_ =
        participant_->create_publisher(edds::PUBLISHER_QOS_DEFAULT)->create_datawriter(topic, writer_qos);
  }
  ~LossyWriter() {
    participant_->delete_contained_entities();
    edds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  void write() { writer_->write(&sample_); }

  std::atomic<bool> dropping{false};

 private:
  edds::DomainParticipant* participant_ = nullptr;
  edds::DataWriter* writer_ = nullptr;
  msg::Percept sample_;
};

TEST(Spy, SeesAGapWhereSamplesVanishOnTheWay) {
  LossyWriter lossy;
  Spy spy;
  ASSERT_TRUE(dds::eventually([&] {
    lossy.write();
    return spy.samples("percept") >= 5;
  }));
  lossy.dropping = true;
  for (int i = 0; i < 7; ++i) lossy.write();
  lossy.dropping = false;
  lossy.write();
  EXPECT_TRUE(spy.reports(EventKind::kGap, "percept", "): 7 samples did not come before number"));
}

TEST(Spy, ExplainsAQosMismatchBetweenOthers) {
  dds::Participant there("foreign", dds::test_network()), here("audio_percept", dds::test_network());
  const observation::PayloadTopic topic{dds::kPercept.name, dds::kPercept.type_name, false};
  observation::PayloadWriter writer(there, topic, {}, 1);
  dds::Reader<msg::Percept> reader(here, dds::kPercept, [](const auto&, const auto&) {});
  Spy spy;
  EXPECT_TRUE(spy.reports(EventKind::kQosMismatch, "percept", "deadline, offered none, requested 100 ms"));
  const auto lock = spy.adapter.lock();
  const diagnostics::NameFilter all;
  const auto text = qos_text({spy.view, contracts(), all, 1, 1.0});
  EXPECT_THAT(text, HasSubstr("deadline: offered none, requested 100 ms"));
  EXPECT_THAT(text, HasSubstr("What to do: give the writer a deadline of at most 100 ms"));
  EXPECT_THAT(
      text, HasSubstr("liveliness: offered automatic, lease none, requested manual by topic, lease 500 ms"));
}

TEST(Spy, MeasuresAForeignTypeAndShowsItsOctets) {
  dds::Participant there("acme", dds::test_network());
  observation::PayloadWriter writer(there, {"acme/notes", "acme::Note", false}, {}, 1);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 0xde, 0xad, 0xbe, 0xef};
  const Repeating writing([&] { writer.write(bytes); });
  std::ostringstream out;
  Request request{.command = Command::kEcho, .topics = {"acme/*"}, .seconds = 30.0, .count = 1, .json = true};
  ASSERT_EQ(run(request, {}, dds::test_network(), out), runtime::kExitDone);
  const auto line = nlohmann::json::parse(out.str());
  EXPECT_EQ(line["type"], "acme::Note");
  EXPECT_EQ(line["size"], 8);
  EXPECT_EQ(line["octets"], "00010000deadbeef");

  std::ostringstream rates;
  request = {.command = Command::kRates, .seconds = 1.5, .json = true};
  ASSERT_EQ(run(request, {}, dds::test_network(), rates), runtime::kExitDone);
  const auto stream = nlohmann::json::parse(rates.str())["streams"].at(0);
  EXPECT_EQ(stream["foreign_type"], "acme::Note");
  EXPECT_EQ(stream["most_octets"], 8);
  EXPECT_GT(stream["rate_hz"], 1.0);
}

// Tries dds_spy: a payload that is cut; garbage
TEST(Spy, GarbageUnderAProjectTypeIsSaidInWords) {
  dds::Participant there("broken", dds::test_network());
  observation::PayloadWriter writer(there, {dds::kPercept.name, dds::kPercept.type_name, false}, {}, 1);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 1, 2, 3, 4};
  const Repeating writing([&] { writer.write(bytes); });
  Spy spy;
  EXPECT_TRUE(spy.reports(EventKind::kUndecodable, "percept",
                          "phantom::msg::Percept.stamp.sequence_number: needs 8 octets at 0, 4 are left"));
}

TEST(Spy, EchoesOneInstanceOfADurableTopicWithItsHistory) {
  dds::Participant there("wva_server", dds::test_network());
  dds::Writer<msg::WorkspaceObject> writer(there, dds::kWorkspaceObject);
  msg::WorkspaceObject object;
  for (std::uint16_t id = 1; id <= 5; ++id) {
    object.id(id);
    object.name("part " + std::to_string(id));
    writer.write(object);
  }
  const Request request{.command = Command::kEcho,
                        .topics = {"workspace_*"},
                        .instances = {"id=3"},
                        .seconds = 30.0,
                        .count = 1,
                        .history = true};
  std::ostringstream out;
  ASSERT_EQ(run(request, {}, dds::test_network(), out), runtime::kExitDone);
  EXPECT_THAT(out.str(), HasSubstr("id: 3\nname: part 3\n"));
}

/// Of a key with several parts one of them is enough.
TEST(Spy, EchoesTheInstancesOfWhichAPartOfTheKeyIsWanted) {
  dds::Participant there("master_io", dds::test_network());
  dds::Writer<msg::ComponentStatus> writer(there, dds::kComponentStatus);
  for (const char* name : {"master_io", "slave_io"}) {
    msg::ComponentStatus status;
    status.component_name(name);
    status.host("desk");
    writer.write(status);
  }
  const auto echoed = [](const std::string& pattern) {
    const Request request{.command = Command::kEcho,
                          .topics = {"component_status"},
                          .instances = {pattern},
                          .seconds = 30.0,
                          .count = 1,
                          .history = true};
    std::ostringstream out;
    EXPECT_EQ(run(request, {}, dds::test_network(), out), runtime::kExitDone) << pattern;
    return out.str();
  };
  for (const char* pattern :
       {"component_name=slave_io", "component_name=slave*", "component_name=slave_io, host=desk"})
    EXPECT_THAT(echoed(pattern), HasSubstr("component_name: slave_io\n")) << pattern;
}

TEST(Spy, ListsParticipantsThatComeAndGo) {
  Spy spy;
  {
    dds::Participant there("visitor", dds::test_network());
    EXPECT_TRUE(spy.reports(EventKind::kParticipantJoined, "", "visitor (process "));
  }
  EXPECT_TRUE(spy.reports(EventKind::kParticipantLeft, "", "visitor (process "));
}

TEST(Session, TypesAreFoundByTypeByItsShortNameAndByTopic) {
  const auto types = [](const std::vector<std::string>& patterns) {
    std::ostringstream out;
    run({.command = Command::kTypes, .topics = patterns}, {}, {}, out);
    return out.str();
  };
  const std::string percept = types({"phantom::msg::Percept"});
  EXPECT_THAT(percept, HasSubstr("struct phantom::msg::Percept {"));
  EXPECT_EQ(types({"Percept"}), percept);
  EXPECT_EQ(types({"percept"}), percept);
  EXPECT_EQ(types({"*ercept", "!skin_*"}), percept);
  const std::string all = types({});
  EXPECT_EQ(types({"*"}), all);
  EXPECT_LT(types({"!Percept"}).size(), all.size());
  EXPECT_THROW(types({"Prcept"}), core::ConfigError);
}

// Tries dds_spy: no participant in the domain
TEST(Spy, SaysThatNobodyIsThere) {
  std::ostringstream out;
  const Request request{.command = Command::kTopology, .seconds = 0.2};
  EXPECT_EQ(run(request, {}, dds::test_network(), out), runtime::kExitMissing);
  EXPECT_THAT(out.str(), HasSubstr("0 participants"));
}

// Tries dds_spy: no writer of the requested topics
TEST(Spy, NamesTheTopicsThatThereAreWhereNoneIsCalledAsAskedFor) {
  dds::Participant there("slave_io", dds::test_network());
  SlaveWriter writer(there);
  std::ostringstream out;
  const Request request{.command = Command::kRates, .topics = {"slave_stat"}, .seconds = 1.0};
  int code = 0;
  testing::internal::CaptureStdout();
  const bool reported = dds::eventually([&] {
    code = run(request, {}, dds::test_network(), out);
    std::cout << std::flush;
    const bool there_are =
        testing::internal::GetCapturedStdout().find("there are: slave_state") != std::string::npos;
    testing::internal::CaptureStdout();
    return there_are;
  });
  testing::internal::GetCapturedStdout();
  EXPECT_TRUE(reported);
  EXPECT_EQ(code, runtime::kExitMissing);
}

// Tries dds_spy: a writer with weaker QoS joins
TEST(Spy, FollowsAWriterWithWeakerQosThatComesLater) {
  dds::Participant there("slave_io", dds::test_network()), other("acme", dds::test_network());
  SlaveWriter slave(there);
  const Repeating writing([&] { slave.write(); });
  Spy spy;
  ASSERT_TRUE(spy.receives("slave_state"));
  observation::PayloadWriter weak(other, {dds::kSlaveState.name, dds::kSlaveState.type_name, false}, {}, 1);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0};
  const Repeating weakly([&] { weak.write(bytes); });
  EXPECT_TRUE(spy.reports(EventKind::kUndecodable, "slave_state", "acme"));
  const auto before = spy.samples("slave_state");
  EXPECT_TRUE(spy.receives("slave_state", before + 10)) << "both are heard";
}

/// A reader that stands still in its first sample until it is let go.
struct Standing : observation::PayloadListener {
  std::promise<void> entered, let_go;
  bool first = true;
  void on_payload(const observation::Payload&) override {
    if (!std::exchange(first, false)) return;
    entered.set_value();
    let_go.get_future().wait();
  }
};

TEST(Spy, AReaderOfItsThatHangsHoldsNoWriterUp) {
  for (const auto reliability :
       {diagnostics::Reliability::kBestEffort, diagnostics::Reliability::kReliable}) {
    dds::Participant there("phantom_sensing", dds::test_network()), here("dds_spy", dds::test_network());
    dds::Writer<msg::HitAlert> writer(there, dds::kHitAlert);
    Standing standing;
    observation::PayloadReader reader(here, {dds::kHitAlert.name, dds::kHitAlert.type_name, false},
                                      {.reliability = reliability}, standing);
    ASSERT_TRUE(dds::eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
    const msg::HitAlert alert;
    ASSERT_TRUE(writer.write(alert));
    standing.entered.get_future().wait();
    auto writing = std::async(std::launch::async, [&] {
      for (int i = 0; i < 1000; ++i) writer.write(alert);  // many times what its history holds
    });
    EXPECT_EQ(writing.wait_for(std::chrono::seconds(30)), std::future_status::ready)
        << diagnostics::to_string(reliability);
    standing.let_go.set_value();
  }
}

TEST(Types, ArePrintedAsIdlWithoutDds) {
  std::ostringstream out;
  EXPECT_EQ(run({.command = Command::kTypes, .topics = {"*::Percept"}}, {}, {}, out), runtime::kExitDone);
  EXPECT_THAT(out.str(), HasSubstr("// topic percept\n"));
  EXPECT_THAT(out.str(), HasSubstr("struct phantom::msg::Percept {\n  phantom::msg::Stamp stamp;\n"));
  EXPECT_THAT(out.str(), HasSubstr("  double drag_torque_Nm[16];\n"));
  EXPECT_THROW(run({.command = Command::kTypes, .topics = {"nothing"}}, {}, {}, out), core::ConfigError);
}

}  // namespace
}  // namespace phantom::dds_spy
