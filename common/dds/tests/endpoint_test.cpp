#include "common/dds/endpoints/endpoint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"

namespace phantom::dds {
namespace {

TEST(Endpoint, PeriodicStateArrivesWholeAndInOrder) {
  Participant there("there", test_network()), here("here", test_network());
  Waiter waiter;
  std::vector<msg::SlaveState> got;
  Reader<msg::SlaveState> reader(here, kSlaveState,
                                 [&](const msg::SlaveState& sample, const SampleInfo& info) {
                                   EXPECT_GT(info.received_ns, 0);
                                   waiter.change([&] { got.push_back(sample); });
                                 });
  Writer<msg::SlaveState> writer(there, kSlaveState);
  ASSERT_TRUE(eventually([&] { return writer.matched() == 1 && reader.matched() == 1; }));

  Stamper stamper(there);
  msg::SlaveState state;
  state.joint_count(7);
  for (std::size_t i = 0; i < 7; ++i) state.position_rad()[i] = 0.25 * static_cast<double>(i);
  state.contact_object(3);
  ASSERT_TRUE(eventually([&] {  // best effort: a sample may be lost, a stream is not
    state.stamp(stamper.next());
    writer.write(state);
    return waiter.wait([&] { return got.size() >= 5; }, std::chrono::seconds(0));
  }));
  SequenceGuard guard;
  for (const auto& sample : got) {
    EXPECT_TRUE(guard.accept(sample.stamp()));
    EXPECT_EQ(sample.stamp().session(), there.session());
    EXPECT_EQ(sample.position_rad(), state.position_rad());
    EXPECT_EQ(sample.contact_object(), 3);
  }
}

TEST(Endpoint, ALateJoinerGetsTheNewestOfEveryKey) {
  Participant server("server", test_network());
  Writer<msg::WorkspaceBrick> writer(server, kWorkspaceBrick);
  msg::WorkspaceBrick brick;
  for (int version = 1; version <= 2; ++version) {
    for (int x = 0; x < 200; ++x) {
      brick.bx(x);
      brick.version(static_cast<std::uint64_t>(version));
      brick.voxels_zstd(std::vector<std::uint8_t>(5000, static_cast<std::uint8_t>(x)));
      ASSERT_TRUE(writer.write(brick));
    }
  }
  brick.bx(7);  // says that it is gone
  brick.version(3);
  brick.voxels_zstd({});
  ASSERT_TRUE(writer.write(brick));

  Participant late("late", test_network());
  Waiter waiter;
  std::map<int, msg::WorkspaceBrick> got;
  Reader<msg::WorkspaceBrick> reader(late, kWorkspaceBrick,
                                     [&](const msg::WorkspaceBrick& sample, const SampleInfo&) {
                                       waiter.change([&] { got[sample.bx()] = sample; });
                                     });
  EXPECT_TRUE(waiter.wait([&] { return got.size() == 200; }));
  waiter.change([&] {
    for (const auto& [x, sample] : got) {
      EXPECT_EQ(sample.version(), x == 7 ? 3u : 2u);
      EXPECT_EQ(sample.voxels_zstd(),
                std::vector<std::uint8_t>(x == 7 ? 0 : 5000, static_cast<std::uint8_t>(x)));
    }
  });
}

TEST(Endpoint, ASampleNamesItsWriterAndTheReaderIsToldWhenThatHasEnded) {
  Participant here("here", test_network());
  auto first = std::make_unique<Participant>("first", test_network());
  auto second = std::make_unique<Participant>("second", test_network());
  const std::uint64_t sessions[] = {first->session(), second->session()};
  Waiter waiter;
  std::map<std::uint64_t, GuidPrefix> writers;  // by the session that the sample tells
  std::vector<GuidPrefix> gone;
  Reader<msg::WorkspaceVersion> reader(
      here, kWorkspaceVersion,
      [&](const msg::WorkspaceVersion& sample, const SampleInfo& info) {
        waiter.change([&] { writers[sample.version()] = info.writer; });
      },
      [&](const GuidPrefix& writer) { waiter.change([&] { gone.push_back(writer); }); });
  msg::WorkspaceVersion version;
  version.cell("bench");
  auto write = [&](Participant& participant) {
    auto writer = std::make_unique<Writer<msg::WorkspaceVersion>>(participant, kWorkspaceVersion);
    version.version(participant.session());
    writer->write(version);
    return writer;
  };
  auto first_writer = write(*first), second_writer = write(*second);
  ASSERT_TRUE(waiter.wait([&] { return writers.size() == 2; }));
  EXPECT_NE(writers[sessions[0]], writers[sessions[1]]);
  EXPECT_TRUE(gone.empty());
  first_writer.reset();
  first.reset();
  EXPECT_TRUE(waiter.wait([&] { return gone.size() == 1 && gone[0] == writers[sessions[0]]; }));
  second_writer.reset();
  EXPECT_TRUE(waiter.wait([&] { return gone.size() == 2 && gone[1] == writers[sessions[1]]; }));
}

TEST(Endpoint, AMismatchingQosIsCountedAtBothEndsAndNothingFlows) {
  Participant there("there", test_network()), here("here", test_network());
  Reader<msg::Percept> reader(here, kPercept,
                              [](const msg::Percept&, const SampleInfo&) { FAIL() << "must not flow"; });
  // A foreign writer that promises no deadline, on a topic whose readers ask for one.
  auto* publisher = there.impl()->publisher;
  auto qos = eprosima::fastdds::dds::DATAWRITER_QOS_DEFAULT;
  qos.data_sharing().off();
  auto* foreign = publisher->create_datawriter(there.impl()->topic(kPercept), qos);
  ASSERT_NE(foreign, nullptr);
  const auto refusals = [&] {
    for (const auto& endpoint : here.endpoints()) {
      if (endpoint.topic == std::string("percept")) return endpoint.incompatible_qos;
    }
    return std::uint64_t{0};
  };
  EXPECT_TRUE(eventually([&] { return refusals() == 1; }));
  EXPECT_EQ(reader.matched(), 0u);
  msg::Percept sample;
  foreign->write(&sample);
  publisher->delete_datawriter(foreign);
}

// As a process ends while it still finds others: what it announces must not reach a participant that it has
// just destroyed.
TEST(Endpoint, MayEndRightAfterAnotherParticipantOfItsProcess) {
  const auto ignore = [](const msg::SlaveState&, const SampleInfo&) {};
  for (int time = 0; time < 100; ++time) {
    Participant stays("stays", test_network());
    auto goes = std::make_unique<Participant>("goes", test_network());
    std::vector<std::unique_ptr<Reader<msg::SlaveState>>> readers;
    for (int i = 0; i < 3; ++i)
      readers.push_back(std::make_unique<Reader<msg::SlaveState>>(stays, kSlaveState, ignore));
    std::this_thread::sleep_for(std::chrono::microseconds(200 * time));
    goes.reset();
    readers.clear();
  }
}

}  // namespace
}  // namespace phantom::dds
