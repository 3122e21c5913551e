#include "common/observation/payload_reader.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <optional>

#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/observation/payload_writer.hpp"

namespace phantom::observation {
namespace {

struct Received : PayloadListener {
  struct Sample {
    std::vector<std::uint8_t> bytes;
    std::uint64_t number;
    core::Nanoseconds source_ns;
  };
  std::mutex mutex;
  std::vector<Sample> samples;
  int lost = 0, back = 0;

  void on_payload(const Payload& payload) override {
    const std::lock_guard lock(mutex);
    samples.push_back(
        {{payload.bytes.begin(), payload.bytes.end()}, payload.sequence_number, payload.source_ns});
  }
  void on_liveliness(const diagnostics::Guid&, bool alive) override {
    const std::lock_guard lock(mutex);
    ++(alive ? back : lost);
  }
  std::size_t count() {
    const std::lock_guard lock(mutex);
    return samples.size();
  }
};

const PayloadTopic kSlaveTopic{"slave_state", "phantom::msg::SlaveState", false};

TEST(PayloadReader, KeepsTheBytesThatATypedWriterWrote) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  Received notes;
  PayloadReader reader(here, kSlaveTopic, {}, notes);
  dds::Writer<msg::SlaveState> writer(there, dds::kSlaveState);
  ASSERT_TRUE(dds::eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));
  msg::SlaveState state;
  state.position_rad()[3] = 0.75;
  ASSERT_TRUE(dds::eventually([&] {
    writer.write(state);
    return notes.count() >= 3;
  }));
  const std::lock_guard lock(notes.mutex);
  std::vector<std::uint8_t> expected;
  ASSERT_TRUE(dds::CdrCodec(dds::kSlaveState).encode(&state, expected));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(notes.samples[i].bytes, expected);
    EXPECT_GT(notes.samples[i].source_ns, 0);
    if (i > 0) {
      EXPECT_GT(notes.samples[i].number, notes.samples[i - 1].number);
    }
  }
}

TEST(PayloadReader, GetsWhatAKeyedDurableWriterKeptForLateJoiners) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  dds::Writer<msg::WorkspaceObject> writer(there, dds::kWorkspaceObject);
  msg::WorkspaceObject object;
  for (std::uint16_t id = 1; id <= 300; ++id) {
    object.id(id);
    ASSERT_TRUE(writer.write(object));
  }
  Received notes;
  PayloadReader reader(here, {"workspace_object", "phantom::msg::WorkspaceObject", true},
                       {.reliability = diagnostics::Reliability::kReliable,
                        .durability = diagnostics::Durability::kTransientLocal},
                       notes, 0);
  EXPECT_TRUE(dds::eventually([&] { return notes.count() == 300; }));
  EXPECT_EQ(reader.rejected(), 0u);
}

TEST(PayloadReader, ReadsEveryPartition) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  Received notes;
  PayloadReader reader(here, {"acme", "acme::Note", false}, {}, notes);
  diagnostics::EndpointQos apart;
  apart.partitions = {"cell_7"};
  PayloadWriter writer(there, {"acme", "acme::Note", false}, apart, 1);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 5, 6, 7, 8};
  ASSERT_TRUE(dds::eventually([&] {
    writer.write(bytes);
    return notes.count() > 0;
  }));
  EXPECT_EQ(notes.samples.front().bytes, bytes);
}

TEST(PayloadReader, ReadsOnePartitionIfAskedTo) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  Received own, other;
  const PayloadTopic topic{"acme", "acme::Note", false};
  PayloadReader reader(here, topic, {.partitions = {"cell_7"}}, own);
  dds::Participant elsewhere("elsewhere", dds::test_network());
  PayloadReader apart(elsewhere, topic, {.partitions = {"cell_8"}}, other);
  diagnostics::EndpointQos qos;
  qos.partitions = {"cell_7"};
  PayloadWriter writer(there, topic, qos, 1);
  const std::vector<std::uint8_t> bytes{0, 1, 0, 0, 5, 6, 7, 8};
  ASSERT_TRUE(dds::eventually([&] {
    writer.write(bytes);
    return own.count() > 0;
  }));
  EXPECT_EQ(writer.matched(), 1u);
  EXPECT_EQ(apart.matched(), 0u);
  EXPECT_EQ(other.count(), 0u);
}

TEST(PayloadReader, TellsAWriterThatStopsProvingThatItLives) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  Received notes;
  PayloadReader reader(here, kSlaveTopic,
                       {.liveliness = diagnostics::Liveliness::kManualByTopic, .lease_ns = 200'000'000},
                       notes);
  dds::Writer<msg::SlaveState> writer(there, dds::kSlaveState);
  ASSERT_TRUE(dds::eventually([&] { return writer.matched() == 1; }));
  msg::SlaveState state;
  const auto in_notes = [&](int Received::*count) {
    const std::lock_guard lock(notes.mutex);
    return notes.*count;
  };
  ASSERT_TRUE(dds::eventually([&] {
    writer.write(state);
    return in_notes(&Received::back) >= 1;
  }));
  EXPECT_TRUE(dds::eventually([&] { return in_notes(&Received::lost) >= 1; })) << "nothing written any more";
}

TEST(PayloadReader, CanGoWhileSamplesCome) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  dds::Writer<msg::SlaveState> writer(there, dds::kSlaveState);
  msg::SlaveState state;
  for (int i = 0; i < 5; ++i) {
    std::optional<Received> notes(std::in_place);
    std::optional<PayloadReader> reader(std::in_place, here, kSlaveTopic, diagnostics::EndpointQos{}, *notes);
    ASSERT_TRUE(dds::eventually([&] {
      writer.write(state);
      return notes->count() > 0;
    }));
    reader.reset();
    notes.reset();
    for (int more = 0; more < 10; ++more) writer.write(state);
  }
}

TEST(PayloadWriter, KeepsInstancesApartInAParticipantThatReadsTheSameType) {
  dds::Participant here("here", dds::test_network()), late("late", dds::test_network());
  const PayloadTopic topic{"state", "acme::State", true};
  Received own, notes;
  PayloadReader reader(here, topic, {}, own);  // knows the type first, without its key
  diagnostics::EndpointQos qos;
  qos.reliability = diagnostics::Reliability::kReliable;
  qos.durability = diagnostics::Durability::kTransientLocal;
  PayloadWriter writer(here, topic, qos, 1, [](std::span<const std::uint8_t> bytes, auto& instance) {
    instance[0] = bytes[4];
    return bytes[4] != 0;
  });
  for (const std::uint8_t id : std::vector<std::uint8_t>{1, 2, 1, 2})
    EXPECT_TRUE(writer.write(std::vector<std::uint8_t>{0, 1, 0, 0, static_cast<std::uint8_t>(id)}));
  EXPECT_FALSE(writer.write(std::vector<std::uint8_t>{0, 1, 0, 0, 0})) << "a sample without a key";
  PayloadReader later(late, topic, qos, notes, 0);
  ASSERT_TRUE(dds::eventually([&] { return notes.count() >= 2; }));
  const std::lock_guard lock(notes.mutex);
  EXPECT_EQ(notes.samples[0].bytes[4] + notes.samples[1].bytes[4], 3) << "the newest of each instance";
}

bool refuses_a_flood(const dds::Participant& participant) {
  const auto refused = participant.refused_datagrams();
  return std::any_of(refused.begin(), refused.end(),
                     [](const dds::Refused& one) { return one.fault == wire::Fault::kFlood; });
}

msg::ComponentStatus status_of(const std::string& name) {
  msg::ComponentStatus status;
  status.component_name(name);
  status.host("here");
  return status;
}

constexpr std::size_t kAtOnce = 256;  // as many as a socket holds
const PayloadTopic kStatusTopic{"component_status", "phantom::msg::ComponentStatus", true};
const diagnostics::EndpointQos kReliable{.reliability = diagnostics::Reliability::kReliable};

// The keys stand in the samples' bytes only: Fast DDS sends no other.
TEST(PayloadReader, WhoBringsTooManyKeysOfATopicOfOursIsHeardNoMoreAndOthersAre) {
  dds::Participant here("here", dds::test_network()), stranger("stranger", dds::test_network());
  Received notes;
  PayloadReader reader(here, kStatusTopic, kReliable, notes);
  const dds::CdrCodec codec(dds::kComponentStatus);
  PayloadWriter writer(
      stranger, kStatusTopic, kReliable, 1,
      [&](std::span<const std::uint8_t> bytes, auto& key) { return codec.instance_of(bytes, key); });
  ASSERT_TRUE(dds::eventually([&] { return reader.matched() == 1 && writer.matched() == 1; }));
  std::vector<std::uint8_t> bytes;
  constexpr std::size_t kMax = PayloadReader::kMinInstances - PayloadReader::kMinInstances / 4;
  for (std::size_t number = 0; number < 2 * kMax && !refuses_a_flood(here); ++number) {
    const msg::ComponentStatus status = status_of("invented_" + std::to_string(number));
    ASSERT_TRUE(codec.encode(&status, bytes));
    writer.write(bytes);
    if (number % kAtOnce == 0) writer.wait_until_received(core::kNsPerSecond);
  }
  EXPECT_TRUE(dds::eventually([&] { return refuses_a_flood(here) && reader.matched() == 0; }));
  EXPECT_LE(notes.count(), kMax);
  dds::Participant honest("honest", dds::test_network());
  dds::Writer<msg::ComponentStatus> own(honest, dds::kComponentStatus);
  const std::size_t before = notes.count();
  ASSERT_TRUE(dds::eventually([&] { return own.matched() == 1; }));
  own.write(status_of("slave_io"));
  EXPECT_TRUE(dds::eventually([&] { return notes.count() > before; })) << "others are heard no more";
}

// As many as one server may have, and more than an observer takes of small topics.
TEST(PayloadReader, AServerOfManyBricksStays) {
  dds::Participant there("there", dds::test_network()), here("here", dds::test_network());
  Received notes;
  PayloadReader reader(here, {"workspace_brick", "phantom::msg::WorkspaceBrick", true}, kReliable, notes);
  dds::Writer<msg::WorkspaceBrick> writer(there, dds::kWorkspaceBrick);
  ASSERT_TRUE(dds::eventually([&] { return reader.matched() == 1 && writer.matched() == 1; }));
  msg::WorkspaceBrick brick;
  constexpr int kBricks = 2 * static_cast<int>(PayloadReader::kMinInstances);
  for (int number = 0; number < kBricks; ++number) {
    brick.bx(number);
    ASSERT_TRUE(writer.write(brick));
    const auto written = static_cast<std::size_t>(number) + 1;
    if (written % kAtOnce == 0) {
      ASSERT_TRUE(dds::eventually([&] { return notes.count() == written; })) << notes.count();
    }
  }
  EXPECT_FALSE(refuses_a_flood(here));
}

TEST(PayloadReader, ATopicOfAnotherTypeInThisParticipantIsRefusedInWords) {
  dds::Participant here("here", dds::test_network());
  Received notes;
  PayloadReader first(here, kSlaveTopic, {}, notes);
  try {
    PayloadReader second(here, {"slave_state", "acme::Note", false}, {}, notes);
    FAIL();
  } catch (const dds::DdsError& problem) {
    EXPECT_NE(std::string(problem.what()).find("slave_state"), std::string::npos);
    EXPECT_NE(std::string(problem.what()).find("acme::Note"), std::string::npos);
  }
}

}  // namespace
}  // namespace phantom::observation
