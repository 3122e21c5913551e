// What a best-effort reader makes of samples that are now larger, now smaller than a message, while fragments
// are lost: it goes on, and has every sample of which nothing was lost.
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <random>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/dds/tests/sent_messages.hpp"
#include "common/dds/tests/test_network.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/participants.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;

constexpr std::uint32_t kMaxOfMessage = 16000;

/// Loses the last fragment of each sample for as long as `losing`.
test::MessageFilter losing_last_fragments(const std::atomic<bool>& losing) {
  return [&](std::span<const std::uint8_t> message) {
    bool lost = false;
    test::for_each_submessage(message, [&](std::uint8_t kind, std::span<const std::uint8_t> fields) {
      if (kind != 0x16 || fields.size() < 36 || fields[15] >= 0x40) return;
      const auto at = [&](std::size_t i) { return std::uint64_t{fields[i]}; };
      const std::uint64_t first = at(24) | at(25) << 8, count = at(28) | at(29) << 8,
                          bytes = at(30) | at(31) << 8, sample = at(32) | at(33) << 8 | at(34) << 16;
      lost = lost || (losing && (first - 1 + count) * bytes >= sample);
    });
    return !lost;
  };
}

class LostFragments : public ::testing::TestWithParam<int> {};

TEST_P(LostFragments, CostTheirSampleAlone) {
  const core::NetworkOptions network = test_network();
  Participant participant("reads", network);
  const TopicSpec<msg::ViewPicture> topic{{"pictures_of_others",
                                           kViewPicture.type_name,
                                           {.reliability = Reliability::kBestEffort, .history_depth = 1},
                                           kViewPicture.make_type,
                                           true}};
  std::atomic<std::size_t> received{0}, newest_bytes{0};
  const Reader<msg::ViewPicture> reader(participant, topic,
                                        [&](const msg::ViewPicture& picture, const SampleInfo&) {
                                          newest_bytes = picture.jpeg().size();
                                          ++received;
                                        });

  std::atomic<bool> losing{false};
  auto* const factory = edds::DomainParticipantFactory::get_instance();
  auto* const server = factory->create_participant(
      network.domain, test::filtered_participant(network, losing_last_fragments(losing), kMaxOfMessage));
  ASSERT_NE(server, nullptr);
  edds::TypeSupport type = topic.make_type();
  ASSERT_TRUE(fast_dds::ok(type.register_type(server)));
  auto* const publisher = server->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  auto* const writer =
      publisher->create_datawriter(server->create_topic(topic.name, topic.type_name, edds::TOPIC_QOS_DEFAULT),
                                   writer_qos(*publisher, topic));
  ASSERT_NE(writer, nullptr);
  const auto send = [&](std::size_t bytes) {
    msg::ViewPicture picture;
    picture.jpeg().resize(bytes, static_cast<std::uint8_t>(bytes));
    return fast_dds::ok(writer->write(&picture));
  };
  ASSERT_TRUE(eventually([&] { return send(10) && received > 0; }, std::chrono::seconds(120)));

  std::mt19937 random(static_cast<unsigned>(GetParam()));
  std::uniform_int_distribution<std::size_t> small(1, 12000), large(20000, 100000);
  for (int i = 0; i < 150; ++i) {
    losing = random() % 2 == 0;
    const std::size_t bytes = random() % 2 == 0 ? small(random) : large(random);
    const bool is_lost = losing && bytes > kMaxOfMessage;
    ASSERT_TRUE(send(bytes));
    if (is_lost) continue;
    ASSERT_TRUE(eventually([&] { return newest_bytes == bytes; }, std::chrono::seconds(60)))
        << "sample " << i << " of " << bytes << " octets; the newest has " << newest_bytes;
  }
  server->delete_contained_entities();
  factory->delete_participant(server);
}

INSTANTIATE_TEST_SUITE_P(Of, LostFragments, ::testing::Range(1, 4));

}  // namespace
}  // namespace phantom::dds
