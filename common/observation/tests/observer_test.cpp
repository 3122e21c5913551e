#include "common/observation/observer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <mutex>
#include <optional>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::observation {
namespace {

struct Notes : DiscoveryListener {
  std::mutex mutex;
  diagnostics::Graph graph;
  std::string log;

  void on_participant(const diagnostics::ParticipantInfo& participant, Presence presence) override {
    const std::lock_guard lock(mutex);
    if (presence == Presence::kAppeared) log += "+" + participant.name + " ";
    if (presence == Presence::kLeft) log += "-" + graph.participant(participant.guid)->name + " ";
    presence == Presence::kLeft ? graph.remove(participant.guid) : graph.put(participant);
  }
  void on_endpoint(const diagnostics::EndpointInfo& endpoint, Presence presence) override {
    const std::lock_guard lock(mutex);
    presence == Presence::kLeft ? graph.remove(endpoint.guid) : graph.put(endpoint);
  }
  std::size_t endpoints() {
    const std::lock_guard lock(mutex);
    return graph.endpoints().size();
  }
};

TEST(Observer, TellsParticipantsEndpointsTheirQosAndTheirLeaving) {
  Notes notes;
  Observer observer("onlooker", dds::test_network(), notes);
  {
    dds::Participant there("slave_io", dds::test_network());
    dds::Writer<msg::SlaveState> writer(there, dds::kSlaveState);
    dds::Reader<msg::WorkspaceObject> reader(there, dds::kWorkspaceObject, [](const auto&, const auto&) {});
    ASSERT_TRUE(dds::eventually([&] { return notes.endpoints() == 2; }));
    const std::lock_guard lock(notes.mutex);
    ASSERT_EQ(notes.graph.participants().size(), 1u) << "the observer itself is not told of";
    const auto& participant = notes.graph.participants().begin()->second;
    EXPECT_EQ(participant.name, "slave_io");
    EXPECT_EQ(participant.process, std::to_string(getpid()));
    EXPECT_EQ(participant.vendor, "Fast DDS");
    EXPECT_FALSE(participant.host.empty());
    EXPECT_EQ(participant.host.find(':'), std::string::npos);
    EXPECT_TRUE(diagnostics::same_host(participant.guid, observer.guid()));
    for (const auto& [guid, endpoint] : notes.graph.endpoints()) {
      if (endpoint.writer) {
        EXPECT_EQ(endpoint.topic, "slave_state");
        EXPECT_EQ(endpoint.type, "phantom::msg::SlaveState");
        EXPECT_FALSE(endpoint.keyed);
        EXPECT_EQ(diagnostics::qos_text(endpoint.qos),
                  "best effort, volatile, deadline 20 ms, liveliness manual by topic, lease 200 ms");
      } else {
        EXPECT_EQ(endpoint.topic, "workspace_object");
        EXPECT_TRUE(endpoint.keyed);
        EXPECT_EQ(diagnostics::qos_text(endpoint.qos), "reliable, transient local");
      }
    }
  }
  EXPECT_TRUE(dds::eventually([&] { return notes.endpoints() == 0; }));
  EXPECT_TRUE(dds::eventually([&] {
    const std::lock_guard lock(notes.mutex);
    return notes.log == "+slave_io -slave_io ";
  }));
}

TEST(Observer, TellsNothingOnceItIsGone) {
  Notes notes;
  std::optional<Observer> observer(std::in_place, "onlooker", dds::test_network(), notes);
  observer.reset();
  dds::Participant late("late", dds::test_network());
  Notes others;
  Observer witness("witness", dds::test_network(), others);
  ASSERT_TRUE(dds::eventually([&] {
    const std::lock_guard lock(others.mutex);
    return others.graph.participants().size() == 1;
  }));
  EXPECT_EQ(notes.log, "");
}

}  // namespace
}  // namespace phantom::observation
