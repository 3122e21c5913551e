// What becomes of a topic in fragments once one of its samples was lost.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/dds/tests/sent_messages.hpp"
#include "common/dds/tests/test_network.hpp"
#include "fast_dds/participants.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;

constexpr std::uint8_t kAcknack = 0x06, kData = 0x15;

/// Returns whether a submessage is of that kind and of a user's writer.
bool is_of_user(std::uint8_t kind, std::span<const std::uint8_t> fields, std::uint8_t wanted) {
  const std::size_t writer = wanted == kData ? 12 : 8;
  return kind == wanted && fields.size() > writer + 3 && fields[writer + 3] < 0x40;
}

struct CountingListener : edds::DataReaderListener {
  std::atomic<int> received{0};
  msg::DepthImage image;
  void on_data_available(edds::DataReader* reader) override {
    edds::SampleInfo info;
    while (fast_dds::ok(reader->take_next_sample(&image, &info))) ++received;
  }
};

/// A reader has room for one sample, but takes those that come while an earlier one is missing: where it
/// refused them, they had to be sent again, which a writer does not do within its suppression of requests. At
/// a heartbeat's rate that went on for twenty seconds.
TEST(LargeSamples, AreTakenAfterALostOneWithoutBeingSentAgain) {
  const core::NetworkOptions network = test_network();
  const Participant loads_profiles("profiles", network);
  std::atomic<bool> lose_one{false}, lose_requests{false};
  std::atomic<int> lost{0};
  const auto of_writer = [&](std::span<const std::uint8_t> message) {
    bool passes = true;
    test::for_each_submessage(message, [&](std::uint8_t kind, std::span<const std::uint8_t> fields) {
      if (is_of_user(kind, fields, kData) && lose_one.exchange(false)) passes = false;
    });
    if (!passes) ++lost;
    return passes;
  };
  const auto of_reader = [&](std::span<const std::uint8_t> message) {
    bool asks = false;
    test::for_each_submessage(message, [&](std::uint8_t kind, std::span<const std::uint8_t> fields) {
      asks = asks || is_of_user(kind, fields, kAcknack);
    });
    return !asks || !lose_requests;
  };
  auto* factory = edds::DomainParticipantFactory::get_instance();
  const TopicDescription& topic = kDepthImage;
  edds::TypeSupport type = topic.make_type();
  const auto join = [&](test::MessageFilter passes) {
    auto* participant =
        factory->create_participant(network.domain, test::filtered_participant(network, std::move(passes)));
    EXPECT_TRUE(fast_dds::ok(type.register_type(participant)));
    return participant;
  };
  auto* camera = join(of_writer);
  auto* viewer = join(of_reader);
  auto* publisher = camera->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  auto* writer =
      publisher->create_datawriter(camera->create_topic(topic.name, topic.type_name, edds::TOPIC_QOS_DEFAULT),
                                   writer_qos(*publisher, topic));
  auto* subscriber = viewer->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT);
  CountingListener listener;
  auto* reader = subscriber->create_datareader(
      viewer->create_topic(topic.name, topic.type_name, edds::TOPIC_QOS_DEFAULT),
      reader_qos(*subscriber, topic), &listener);
  ASSERT_NE(writer, nullptr);
  ASSERT_NE(reader, nullptr);
  msg::DepthImage image;
  image.depth_mm().resize(200, 1000);
  const auto receives_more = [&] {
    const int before = listener.received;
    return eventually([&] {
      writer->write(&image);
      return listener.received > before + 5;
    });
  };
  ASSERT_TRUE(receives_more());
  lose_requests = true;
  lose_one = true;
  EXPECT_TRUE(receives_more());
  EXPECT_EQ(lost, 1);

  for (auto* participant : {viewer, camera}) {
    participant->delete_contained_entities();
    factory->delete_participant(participant);
  }
}

}  // namespace
}  // namespace phantom::dds
