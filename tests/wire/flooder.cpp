// A stranger with real writers: announces its endpoints as anybody does, then sends sound samples of one
// topic under keys that it invents, as fast as the wire takes them. Prints how many, and stays until its
// standard input ends, so that what it wrote stays with it for late joiners.
//
//   flooder DOMAIN meshes|chunks|statuses|bricks|versions|objects COUNT READERS

#include <chrono>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/status_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/brick_codec.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/transport.hpp"

namespace {

using namespace phantom;
namespace edds = eprosima::fastdds::dds;

/// Makes the sample of that number.
template <class T>
using SampleBuilder = std::function<T(std::uint64_t number)>;

/// A participant of Fast DDS as it comes, on loopback by UDP.
edds::DomainParticipant& stranger(int domain) {
  auto udp = std::make_shared<phantom::fast_dds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {"127.0.0.1"};
  edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
  qos.name("stranger");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  auto* made = edds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<edds::DomainId_t>(domain), qos);
  if (made == nullptr) throw std::runtime_error("no participant");
  return *made;
}

constexpr int kAtOnce = 1000;

/// Reliable and durable, as the readers want it. It forgets samples that its readers have, so that nothing
/// but the wire and its readers bounds how many it sends.
edds::DataWriterQos writer_qos() {
  edds::DataWriterQos qos = edds::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = edds::RELIABLE_RELIABILITY_QOS;
  qos.reliability().max_blocking_time = {30, 0};
  qos.durability().kind = edds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = edds::KEEP_ALL_HISTORY_QOS;
  qos.resource_limits().max_samples = 0;
  qos.resource_limits().max_instances = 0;
  qos.resource_limits().max_samples_per_instance = 0;
  qos.endpoint().history_memory_policy = phantom::fast_dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  phantom::fast_dds::set_heartbeats(qos, {0, 5'000'000}, {0, 5'000'000});
  return qos;
}

/// Writes `count` samples once that many readers are there; returns how many were taken.
template <class T>
std::uint64_t flood(edds::DomainParticipant& participant, const phantom::dds::TopicSpec<T>& topic,
                    const SampleBuilder<T>& make, std::uint64_t count, int readers) {
  edds::TypeSupport type = topic.make_type();
  type.register_type(&participant);
  auto* of = participant.create_topic(topic.name, topic.type_name, edds::TOPIC_QOS_DEFAULT);
  auto* writer =
      participant.create_publisher(edds::PUBLISHER_QOS_DEFAULT)->create_datawriter(of, writer_qos());
  edds::PublicationMatchedStatus matched;
  do {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    writer->get_publication_matched_status(matched);
  } while (matched.current_count < readers);
  std::cout << "begins" << std::endl;
  std::uint64_t written = 0;
  bool heard = true;  // until its readers take no more of it
  for (std::uint64_t i = 0; i < count; ++i) {
    T sample = make(i);
    written += phantom::fast_dds::ok(writer->write(&sample)) ? 1 : 0;
    if (i % kAtOnce != kAtOnce - 1) continue;
    heard = heard && phantom::fast_dds::ok(writer->wait_for_acknowledgments({5, 0}));
    std::size_t removed = 0;
    writer->clear_history(&removed);
  }
  if (heard) writer->wait_for_acknowledgments({60, 0});
  return written;
}

/// A mesh of `chunk_count` pieces of one octet each, of which it sends `sent`.
SampleBuilder<msg::MeshChunk> chunks(std::uint32_t chunk_count, std::uint32_t sent) {
  return [=](std::uint64_t number) {
    messages::MeshChunk chunk{.mesh_hash = 1 + number / sent,
                              .chunk = static_cast<std::uint32_t>(number % sent),
                              .chunk_count = chunk_count,
                              .vertex_count = 1000,
                              .triangle_count = 1000};
    chunk.data = {7};
    return messages::to_idl(chunk);
  };
}

SampleBuilder<msg::ComponentStatus> statuses() {
  return [](std::uint64_t number) {
    messages::ComponentStatus status;
    status.component = "stranger_" + std::to_string(number);
    status.host = "nowhere";
    status.message.assign(200, 'x');
    status.stamp = {1 + number, core::monotonic_ns(), 7};
    return messages::to_idl(status);
  };
}

/// Bricks that do not compress, each at a place of its own.
SampleBuilder<msg::WorkspaceBrick> bricks() {
  workspace::Workspace one({{0, 0, 0}, 0.01, {32, 32, 32}}, std::vector<float>{0.0F, 1.0F, 2.0F, 3.0F});
  std::mt19937 random(1);
  workspace::BrickLabels labels{std::make_shared<std::int8_t[]>(workspace::kBrickVoxels), nullptr, 1};
  std::uint8_t* codes = one.make_brick({0, 0, 0}, labels);
  for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i)
    codes[i] = static_cast<std::uint8_t>(random() % 4);
  const auto packed = workspace::encode_brick(one.brick({0, 0, 0}));
  return [packed](std::uint64_t number) {
    const auto place = [&](int axis) { return static_cast<std::int32_t>(number >> 6 * axis & 63); };
    return messages::to_idl(messages::WorkspaceBrick{{place(0), place(1), place(2)}, 1 + number, packed});
  };
}

/// Versions of which none becomes whole, each with another grid.
SampleBuilder<msg::WorkspaceVersion> versions() {
  return [](std::uint64_t number) {
    messages::WorkspaceVersion version;
    version.cell = "cell_" + std::to_string(number);
    version.description = {1 + number, {{0, 0, 0}, 0.01, {8192, 8192, 8192}}, {}, 262144, number};
    for (int code = 0; code < 256; ++code)
      version.description.palette_Pa_s_per_m.push_back(static_cast<float>(code) *
                                                       (1.0F + static_cast<float>(number % 1000)));
    return messages::to_idl(version);
  };
}

SampleBuilder<msg::WorkspaceObject> objects() {
  return [](std::uint64_t number) {
    return messages::to_idl(messages::WorkspaceObject{
        static_cast<std::uint16_t>(1 + number % 65534), std::string(60, 'x'), 1 + number, {}, {}});
  };
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::cerr << "usage: flooder DOMAIN KIND COUNT READERS\n";
    return 2;
  }
  auto& participant = stranger(std::atoi(argv[1]));
  const std::uint64_t count = std::stoull(argv[3]);
  const int readers = std::atoi(argv[4]);
  const std::map<std::string, std::function<std::uint64_t()>> kinds{
      {"meshes",
       [&] { return flood(participant, phantom::dds::kMeshChunk, chunks(4096, 4), count, readers); }},
      {"chunks",
       [&] { return flood(participant, phantom::dds::kMeshChunk, chunks(4096, 4095), count, readers); }},
      {"statuses",
       [&] { return flood(participant, phantom::dds::kComponentStatus, statuses(), count, readers); }},
      {"bricks", [&] { return flood(participant, phantom::dds::kWorkspaceBrick, bricks(), count, readers); }},
      {"versions",
       [&] { return flood(participant, phantom::dds::kWorkspaceVersion, versions(), count, readers); }},
      {"objects",
       [&] { return flood(participant, phantom::dds::kWorkspaceObject, objects(), count, readers); }}};
  std::cout << kinds.at(argv[2])() << std::endl;
  while (std::cin.get() != EOF) continue;
  return 0;
}
