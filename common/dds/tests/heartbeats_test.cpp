// What a late joiner costs: bricks are sent again, heartbeats are not sent with each of them.
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/dds/tests/sent_messages.hpp"
#include "common/dds/tests/test_network.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/participants.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;

TEST(Heartbeats, AreNotSentWithEachBrickToALateJoiner) {
  constexpr int kBricks = 500, kLateJoiners = 3;
  constexpr std::size_t kBytes = 12000;  // 6 MB for each who joins
  const core::NetworkOptions network = test_network();
  const Participant loads_profiles("profiles", network);

  std::atomic<int> heartbeats{0};  // of users' writers
  const auto count = [&](std::span<const std::uint8_t> message) {
    test::for_each_submessage(message, [&](std::uint8_t kind, std::span<const std::uint8_t> fields) {
      if (kind == 0x07 && fields.size() >= 12 && fields[11] < 0x40) ++heartbeats;
    });
    return true;
  };
  auto* factory = edds::DomainParticipantFactory::get_instance();
  auto* server = factory->create_participant(network.domain, test::filtered_participant(network, count));
  ASSERT_NE(server, nullptr);
  const TopicDescription& topic = kWorkspaceBrick;
  edds::TypeSupport type = topic.make_type();
  ASSERT_TRUE(fast_dds::ok(type.register_type(server)));
  auto* publisher = server->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  edds::DataWriterQos qos = writer_qos(*publisher, topic);
  fast_dds::set_heartbeats(qos, {0, 500'000'000}, {0, 0});
  auto* writer = publisher->create_datawriter(
      server->create_topic(topic.name, topic.type_name, edds::TOPIC_QOS_DEFAULT), qos);
  ASSERT_NE(writer, nullptr);
  for (int i = 0; i < kBricks; ++i) {
    msg::WorkspaceBrick brick;
    brick.bx(i);
    brick.voxels_zstd().resize(kBytes, static_cast<std::uint8_t>(i));
    ASSERT_TRUE(fast_dds::ok(writer->write(&brick)));
  }

  const auto start = std::chrono::steady_clock::now();
  for (int joiner = 0; joiner < kLateJoiners; ++joiner) {
    Participant late("late", network);
    std::atomic<int> bricks{0};
    const Reader<msg::WorkspaceBrick> reader(
        late, kWorkspaceBrick, [&](const msg::WorkspaceBrick&, const SampleInfo&) { ++bricks; });
    EXPECT_TRUE(eventually([&] { return bricks == kBricks; }, std::chrono::seconds(120)));
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // The periodic ones, and those that answer a reader that still misses some: few beside the bricks.
  EXPECT_LT(heartbeats, kLateJoiners * kBricks / 4) << "in " << seconds << " s";
  EXPECT_GT(heartbeats, 0) << "the count counts nothing";

  server->delete_contained_entities();
  factory->delete_participant(server);
}

}  // namespace
}  // namespace phantom::dds
