#include "components/slave_io/dds_adapter.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>

#include "common/dds/admission/source_guard.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/stamp.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/messages/codecs/workspace_codec.hpp"

namespace phantom::slave_io {
namespace {

msg::MasterState good() {
  msg::MasterState master;
  master.stamp().sequence_number(7);
  master.stamp().monotonic_ns(123);
  master.stamp().session(99);
  master.joint_count(7);
  master.state(msg::LinkState::LINK_COUPLED);
  for (std::size_t j = 0; j < 7; ++j) master.position_rad()[j] = 0.1 * static_cast<double>(j);
  return master;
}

messages::ArmBounds expected() {
  messages::ArmBounds arm;
  arm.joint_count = 7;
  arm.lower.fill(-1.0);
  arm.upper.fill(1.0);
  return arm;
}

// Tries slave_io: master restarts
TEST(SlaveAdapter, ReorderedAndRepeatedSamplesAreRefusedARestartedMasterIsNot) {
  dds::SourceGuard source;
  auto master = good();
  core::Nanoseconds now_ns = core::kNsPerSecond;
  const auto takes = [&] {
    return source.assess(master.stamp(), now_ns) == dds::SourceGuard::Verdict::kAccepted;
  };
  EXPECT_TRUE(takes());
  EXPECT_FALSE(takes());
  master.stamp().sequence_number(5);
  EXPECT_FALSE(takes());
  master.stamp().session(100);
  now_ns += dds::SourceGuard::kHold_ns;
  EXPECT_TRUE(takes());
}

// On the real topics: the first writer is followed, the second one refused and told; when the first ends, the
// second takes its place.
// Tries slave_io: a second process sends master_state
TEST(SlaveAdapter, OfTwoMastersOnTheTopicOnlyTheFirstIsFollowed) {
  const auto network = dds::test_network();
  Inbox inbox;
  DdsAdapter adapter(network, expected(), inbox);
  auto first = std::make_unique<dds::Participant>("master_io", network);
  dds::Participant second("master_io", network);
  auto first_writer = std::make_unique<dds::Writer<msg::MasterState>>(*first, dds::kMasterState);
  dds::Writer<msg::MasterState> second_writer(second, dds::kMasterState);
  dds::Stamper first_stamper(*first), second_stamper(second);
  std::mutex mutex;
  std::string reported;
  msg::ComponentState state{};
  dds::Reader<msg::ComponentStatus> statuses(second, dds::kComponentStatus,
                                             [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                               const std::lock_guard lock(mutex);
                                               reported = s.message().to_string();
                                               state = s.state();
                                             });
  const auto write = [](auto& writer, auto& stamper, double q) {
    auto master = good();
    master.position_rad().fill(q);
    master.stamp(stamper.next());
    writer.write(master);
  };
  MasterSample sample;
  const auto until = [&](const auto& step, const auto& done) {
    for (int i = 0; i < 3000; ++i) {
      step();
      inbox.master.read(sample);
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  };
  ASSERT_TRUE(
      until([&] { write(*first_writer, first_stamper, 0.5); }, [&] { return sample.position[0] == 0.5; }));
  ASSERT_TRUE(until(
      [&] {
        write(*first_writer, first_stamper, 0.5);
        write(second_writer, second_stamper, 0.9);
        adapter.publish_health({core::ComponentState::kRunning, "", {}, {}});
      },
      [&] {
        const std::lock_guard lock(mutex);
        return reported.find("two processes send master_state") != std::string::npos &&
               state == msg::ComponentState::COMPONENT_DEGRADED;
      }));
  EXPECT_EQ(sample.position[0], 0.5) << "whoever came first";
  first_writer.reset();
  EXPECT_TRUE(
      until([&] { write(second_writer, second_stamper, 0.9); }, [&] { return sample.position[0] == 0.9; }))
      << "it takes the first one's place";
}

/// A wva_server of a cell with object 2, which arms may carry.
struct ServerOfGauge {
  explicit ServerOfGauge(const core::NetworkOptions& network) : participant("wva_server", network) {
    object.id = 2;
    object.name = "gauge";
    object.mesh_hash = 1;
    version.cell = "cell";
    version.description = {1, {Eigen::Vector3d::Zero(), 0.005, {32, 32, 32}}, {0.0F, 1.0F}, 0, 0};
  }
  void write() {
    objects.write(messages::to_idl(object));
    versions.write(messages::to_idl(version));
  }
  void is_carried_by(const std::string& arm) {
    messages::CarriedObject carried;
    carried.id = 2;
    carried.arm = arm;
    carried.frame = "tool";
    carried.mesh_hash = 1;
    version.carried = {carried};
  }
  dds::Participant participant;
  dds::Writer<msg::WorkspaceObject> objects{participant, dds::kWorkspaceObject};
  dds::Writer<msg::WorkspaceVersion> versions{participant, dds::kWorkspaceVersion};
  messages::WorkspaceObject object;
  messages::WorkspaceVersion version;
};

TEST(SlaveAdapter, TellsTheServoWhereTheObjectsAreThatBearOnlySoMuch) {
  using Place = BoundedPlaces::Place;
  const auto network = dds::test_network();
  Inbox inbox;
  DdsAdapter adapter(network, expected(), inbox);
  adapter.follow_workspace({nullptr, "left", 10.0, {}}, {{7, "window", 20.0}, {2, "gauge", 8.0}});
  BoundedPlaces places;
  const BoundedPlaces::Object& gauge = places.objects[1];
  const auto tells = [&](const auto& what) {
    return dds::eventually([&] {
      inbox.places.read(places);
      return what();
    });
  };
  auto server = std::make_unique<ServerOfGauge>(network);
  server->object.X_WO.translation_m = {0.1, 0.2, 0.3};
  server->write();
  ASSERT_TRUE(tells([&] { return gauge.place == Place::kAtPose; }));
  EXPECT_EQ(gauge.translation_m, (std::array{0.1, 0.2, 0.3}));
  EXPECT_EQ(places.objects[0].place, Place::kAsConfigured) << "nobody told of it";
  EXPECT_FALSE(places.carries);

  server->is_carried_by("right");
  server->write();
  ASSERT_TRUE(tells([&] { return gauge.place == Place::kAnywhere; }));
  EXPECT_FALSE(places.carries);
  server->is_carried_by("left");
  server->write();
  ASSERT_TRUE(tells([&] { return places.carries; }));
  server->version.carried.clear();
  server->object.X_WO.translation_m = {0.4, 0.5, 0.6};
  server->write();
  ASSERT_TRUE(tells([&] { return gauge.place == Place::kAtPose && gauge.translation_m[0] == 0.4; }));
  EXPECT_FALSE(places.carries);
  server->object.name = "another";
  server->write();
  ASSERT_TRUE(tells([&] { return gauge.place == Place::kAnywhere; }));
  server->object.mesh_hash = 0;
  server->write();
  ASSERT_TRUE(tells([&] { return gauge.place == Place::kGone; }));

  // A second server counts once the first has gone, with what it said meanwhile: it says it once.
  auto second = std::make_unique<ServerOfGauge>(network);
  second->object.X_WO.translation_m = {0.7, 0.8, 0.9};
  second->write();
  EXPECT_FALSE(dds::eventually(
      [&] {
        inbox.places.read(places);
        return gauge.place == Place::kAtPose;
      },
      0.3));
  server.reset();
  EXPECT_TRUE(tells([&] { return gauge.place == Place::kAtPose; }));
  EXPECT_EQ(gauge.translation_m, (std::array{0.7, 0.8, 0.9}));
}

// Tries slave_io: master_state invalid
TEST(SlaveAdapter, AnInvalidSampleIsRefusedCountedAndLeavesTheLastGoodOne) {
  const auto network = dds::test_network();
  Inbox inbox;
  DdsAdapter adapter(network, expected(), inbox);
  dds::Participant master("master_io", network);
  dds::Writer<msg::MasterState> writer(master, dds::kMasterState);
  dds::Stamper stamper(master);
  std::atomic<std::uint64_t> refused{0};
  dds::Reader<msg::ComponentStatus> statuses(master, dds::kComponentStatus,
                                             [&](const msg::ComponentStatus& s, const dds::SampleInfo&) {
                                               for (const auto& topic : s.topics())
                                                 if (topic.topic() == "master_state" && !topic.writer())
                                                   refused = topic.refused();
                                             });
  auto sample = good();
  const auto send = [&] {
    sample.stamp(stamper.next());
    writer.write(sample);
    adapter.publish_health({core::ComponentState::kRunning, "", {}, {}});
  };
  MasterSample taken;
  ASSERT_TRUE(dds::eventually([&] {
    send();
    return inbox.master.read(taken);
  }));
  const auto held = taken.position;
  sample.position_rad()[2] = std::nan("");
  EXPECT_TRUE(dds::eventually([&] {
    send();
    return refused >= 3;
  }));
  inbox.master.read(taken);
  EXPECT_EQ(taken.position, held);
  sample = good();
  sample.position_rad().fill(0.7);
  EXPECT_TRUE(dds::eventually([&] {
    send();
    return inbox.master.read(taken) && taken.position[0] == 0.7;
  })) << "the next good one is taken";
}

}  // namespace
}  // namespace phantom::slave_io
