// What a late joiner costs: bricks are sent again, heartbeats are not sent with each of them.
#include <gtest/gtest.h>

#include <atomic>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>

#include "common/dds/endpoint.hpp"
#include "common/dds/participant_impl.hpp"
#include "common/dds/qos.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/dds/topic_list.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/participants.hpp"
#include "fast_dds/transport.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace transport = fast_dds::rtps;
using fast_dds::rtps::Locator_t;
using fast_dds::rtps::octet;

std::atomic<int> g_heartbeats{0};  // of users' writers, sent by participants with CountingDescriptor

/// Counts the heartbeats in an RTPS message (OMG DDSI-RTPS 2.3, 8.3.3, 9.4.5) that are not of built-in
/// writers.
int heartbeats_in(const std::vector<std::uint8_t>& message) {
  int found = 0;
  const auto size = static_cast<std::uint32_t>(message.size());
  for (std::uint32_t at = 20; at + 4 <= size;) {
    const bool little = (message[at + 1] & 1) != 0;
    const std::uint32_t length =
        little ? message[at + 2] + 256U * message[at + 3] : 256U * message[at + 2] + message[at + 3];
    // Kind 7; after the reader's entity id the writer's, whose last byte is below 64 for users'.
    if (message[at] == 0x07 && at + 12 <= size && message[at + 11] < 0x40) ++found;
    if (length == 0) break;
    at += 4 + length;
  }
  return found;
}

class CountingTransport;
struct CountingDescriptor : transport::ChainingTransportDescriptor {
  using transport::ChainingTransportDescriptor::ChainingTransportDescriptor;
  [[nodiscard]] transport::TransportInterface* create_transport() const override;
};

class CountingTransport final : public fast_dds::MessageTransport {
 public:
  explicit CountingTransport(const CountingDescriptor& descriptor)
      : MessageTransport(descriptor), descriptor_(descriptor) {}
  transport::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }
  bool send_on(transport::SenderResource& below, const fast_dds::OutgoingMessage& message) override {
    g_heartbeats += heartbeats_in(message.octets());
    return message.send_by(below);
  }
  void receive(transport::TransportReceiverInterface* above, const octet* message, std::uint32_t size,
               const Locator_t& local, const Locator_t& remote) override {
    above->OnDataReceived(message, size, local, remote);
  }

 private:
  CountingDescriptor descriptor_;
};

transport::TransportInterface* CountingDescriptor::create_transport() const {
  return new CountingTransport(*this);
}

TEST(Heartbeats, AreNotSentWithEachBrickToALateJoiner) {
  constexpr int kBricks = 500, kLateJoiners = 3;
  constexpr std::size_t kBytes = 12000;  // 6 MB for each who joins
  fast_dds::deliver_by_transport();
  const core::NetworkOptions network = test_network();
  const Participant loads_profiles("profiles", network);

  edds::DomainParticipantQos participant_qos;
  participant_qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<transport::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = network.interfaces;
  udp->receiveBufferSize = udp->sendBufferSize = 4 << 20;
  participant_qos.transport().user_transports.push_back(std::make_shared<CountingDescriptor>(udp));
  auto* factory = edds::DomainParticipantFactory::get_instance();
  auto* server = factory->create_participant(network.domain, participant_qos);
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
  // The periodic ones, to one reader at a time, and one for each who is met; three readers' 1500 bricks bring
  // none.
  EXPECT_LT(g_heartbeats, 2 * seconds + 20 * kLateJoiners) << "in " << seconds << " s";
  EXPECT_GT(g_heartbeats, 0) << "the count counts nothing";

  server->delete_contained_entities();
  factory->delete_participant(server);
}

}  // namespace
}  // namespace phantom::dds
