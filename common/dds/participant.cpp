#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastrtps/utils/IPLocator.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <set>

#include "common/core/host_interfaces.hpp"
#include "common/core/random.hpp"
#include "common/dds/dds_threads.hpp"
#include "common/dds/fast_dds_log.hpp"
#include "common/dds/participant_impl.hpp"
#include "common/dds/qos.hpp"
#include "common/dds/readmission.hpp"
#include "common/dds/security.hpp"
#include "common/dds/topic_list.hpp"
#include "common/dds/transport.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

// The factory keeps profiles for the process's life and refuses a second file with the same names, so each
// file that it has accepted is loaded once.
void load_profiles(const std::filesystem::path& file) {
  take_over_fast_dds_log();
  static std::mutex mutex;
  static std::set<std::filesystem::path> loaded;
  const std::lock_guard lock(mutex);
  if (!std::filesystem::is_regular_file(file)) throw DdsError(file.string() + ": QoS profiles: no such file");
  const auto known_as = std::filesystem::canonical(file);
  if (loaded.contains(known_as)) return;
  auto* factory = edds::DomainParticipantFactory::get_instance();
  if (factory->load_XML_profiles_file(file.string()) != ReturnCode_t::RETCODE_OK) {
    eprosima::fastdds::dds::Log::Flush();
    throw DdsError(file.string() +
                   ": QoS profiles: the file is refused by Fast DDS (one bad element rejects the whole "
                   "file; the lines above name it)");
  }
  loaded.insert(known_as);
}

// Clients announce to the servers alone. `whole`: the client receives every endpoint, not only those that
// match its own.
void use_discovery_servers(rtps::DiscoverySettings& discovery, const std::vector<std::string>& servers,
                           bool whole) {
  using Protocol = rtps::DiscoveryProtocol_t;
  discovery.discoveryProtocol = whole ? Protocol::SUPER_CLIENT : Protocol::CLIENT;
  for (std::size_t id = 0; id < servers.size(); ++id) {
    const auto colon = servers[id].rfind(':');
    rtps::Locator_t locator;
    locator.kind = LOCATOR_KIND_UDPv4;
    rtps::IPLocator::setIPv4(locator, servers[id].substr(0, colon));
    locator.port = static_cast<std::uint32_t>(std::stoul(servers[id].substr(colon + 1)));
    eprosima::fastdds::rtps::RemoteServerAttributes server;
    char prefix[64];  // the GUID prefix of `fast-discovery-server -i ID`
    std::snprintf(prefix, sizeof prefix, "44.53.%02zx.5f.45.50.52.4f.53.49.4d.41", id);
    server.ReadguidPrefix(prefix);
    server.metatrafficUnicastLocatorList.push_back(locator);
    discovery.m_DiscoveryServers.push_back(server);
  }
}

edds::DomainParticipantQos participant_qos(const std::string& component, const core::NetworkOptions& network,
                                           bool observes) {
  edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
  qos.name(component);
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport_of(network));
  auto& discovery = qos.wire_protocol().builtin.discovery_config;
  discovery.leaseDuration = {5, 0};
  discovery.leaseDuration_announcementperiod = {1, 0};
  for (const auto& peer : network.initial_peers) {
    rtps::Locator_t locator;
    locator.kind = LOCATOR_KIND_UDPv4;
    if (!rtps::IPLocator::setIPv4(locator, peer)) {
      throw DdsError("network.initial_peers: '" + peer + "' is not an IPv4 address");
    }
    qos.wire_protocol().builtin.initialPeersList.push_back(locator);
  }
  if (!network.discovery_servers.empty())
    use_discovery_servers(discovery, network.discovery_servers, observes);
  if (!network.security.empty()) add_security(qos.properties(), network.security, component);
  return qos;
}

enum class Joins { kNow, kNever };

// Creates every participant of the process, one at a time: whether a participant joins is a setting of the
// factory, which all threads share. Returns null if Fast DDS refuses.
edds::DomainParticipant* make_participant(int domain, const edds::DomainParticipantQos& qos,
                                          edds::DomainParticipantListener* listener, Joins joins) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  auto* factory = edds::DomainParticipantFactory::get_instance();
  edds::DomainParticipantFactoryQos before;
  factory->get_qos(before);
  edds::DomainParticipantFactoryQos wanted = before;
  wanted.entity_factory().autoenable_created_entities = joins == Joins::kNow;
  factory->set_qos(wanted);
  auto* made = factory->create_participant(static_cast<edds::DomainId_t>(domain), qos, listener,
                                           edds::StatusMask::none());
  factory->set_qos(before);
  return made;
}

}  // namespace

Participant::Impl::~Impl() {
  if (readmission) readmission->stop();
  if (participant == nullptr) return;
  participant->delete_contained_entities();
  edds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}

edds::Topic* Participant::Impl::topic(const TopicDescription& description) {
  const std::lock_guard lock(mutex);
  if (auto* known = participant->lookup_topicdescription(description.name))
    return static_cast<edds::Topic*>(known);
  const edds::TypeSupport type = description.make_type();
  type.register_type(participant, description.type_name);
  auto* made = participant->create_topic(description.name, description.type_name, edds::TOPIC_QOS_DEFAULT);
  if (made == nullptr) throw DdsError(std::string("topic ") + description.name + ": refused by Fast DDS");
  return made;
}

std::shared_ptr<EndpointCounters> Participant::Impl::add_counters(const TopicDescription& topic,
                                                                  bool writer) {
  auto added = std::make_shared<EndpointCounters>();
  added->topic = &topic;
  added->writer = writer;
  const std::lock_guard lock(mutex);
  counters.push_back(added);
  return added;
}

void report_incompatible(const std::string& component, const EndpointCounters& counters, int policy_id) {
  spdlog::error(
      "topic {}: {}'s {} and another participant's {} do not fit: {} differs (policy {}); "
      "nothing flows between them. Both must use the topic's QoS profile.",
      counters.topic->name, component, counters.writer ? "writer" : "reader",
      counters.writer ? "reader" : "writer", policy_name(policy_id), policy_id);
}

void check_qos_profiles(const std::filesystem::path& qos_profiles) {
  load_profiles(qos_profiles);
  // A participant that never joins announces nothing and opens no port.
  auto* participant = make_participant(0, edds::PARTICIPANT_QOS_DEFAULT, nullptr, Joins::kNever);
  if (participant == nullptr) throw DdsError("a DDS participant could not be made");
  struct Cleanup {
    edds::DomainParticipant* participant;
    ~Cleanup() {
      participant->delete_contained_entities();
      edds::DomainParticipantFactory::get_instance()->delete_participant(participant);
    }
  } cleanup{participant};
  auto* publisher = participant->create_publisher(edds::PUBLISHER_QOS_DEFAULT);
  auto* subscriber = participant->create_subscriber(edds::SUBSCRIBER_QOS_DEFAULT);
  for (const TopicDescription* topic : all_topics()) {
    try {
      writer_qos(*publisher, *topic);
      reader_qos(*subscriber, *topic);
    } catch (const DdsError& problem) {
      throw DdsError(qos_profiles.string() + ": " + problem.what());
    }
  }
}

Participant::Participant(const std::string& component, const core::NetworkOptions& network,
                         std::shared_ptr<edds::DomainParticipantListener> discovery)
    : impl_(std::make_shared<Impl>()) {
  check_qos_profiles(network.qos_profiles);
  core::require_interfaces(network, core::host_interfaces());
  impl_->component = component;
  impl_->servo_priority = network.servo_priority;
  impl_->session = core::random_number();
  const bool observes = discovery != nullptr;
  impl_->discovery = std::move(discovery);
  if (network.discovery_servers.empty()) {  // with discovery servers, a peer's end is reported by others
    impl_->discovery = impl_->readmission =
        std::make_shared<Readmission>(component, !network.security.empty(), impl_->discovery);
  }
  with_dds_threads(network.servo_priority > 0, [&] {
    impl_->participant = make_participant(network.domain, participant_qos(component, network, observes),
                                          impl_->discovery.get(), Joins::kNow);
  });
  if (impl_->participant == nullptr) {
    throw DdsError("domain " + std::to_string(network.domain) + ": Fast DDS could not join" +
                   (network.security.empty() ? ""
                                             : "; check the documents by deploy/security/make check " +
                                                   network.security.string()));
  }
  if (impl_->readmission) impl_->readmission->start(impl_->participant->guid());
  edds::PublisherQos publisher = edds::PUBLISHER_QOS_DEFAULT;
  edds::SubscriberQos subscriber = edds::SUBSCRIBER_QOS_DEFAULT;
  if (!network.partition.empty()) {
    publisher.partition().push_back(network.partition.c_str());
    subscriber.partition().push_back(network.partition.c_str());
  }
  impl_->publisher = impl_->participant->create_publisher(publisher);
  impl_->subscriber = impl_->participant->create_subscriber(subscriber);
}

Participant::~Participant() = default;

// Clears the history first: Fast DDS 2.9 frees a writer's samples while its heartbeats may read them, and
// such a heartbeat never ends (fixed after 2.12, https://github.com/eProsima/Fast-DDS/pull/4076).
void delete_writer(edds::Publisher& publisher, edds::DataWriter* writer) {
  std::size_t removed = 0;
  writer->clear_history(&removed);
  publisher.delete_datawriter(writer);
}

const std::string& Participant::component() const { return impl_->component; }
std::uint64_t Participant::session() const { return impl_->session; }
int Participant::servo_priority() const { return impl_->servo_priority; }

std::vector<EndpointStatistics> Participant::endpoints() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<EndpointStatistics> statistics;
  const core::Nanoseconds now_ns = core::monotonic_ns();
  for (const auto& c : impl_->counters) {
    const core::Nanoseconds busy_since_ns = c->busy_since_ns.load(std::memory_order_relaxed);
    statistics.push_back({c->topic->name, c->writer, c->matched, c->samples, c->refused, c->deadline_missed,
                          c->liveliness_lost, c->incompatible_qos,
                          busy_since_ns != 0 ? core::seconds(now_ns - busy_since_ns) : 0.0});
  }
  return statistics;
}

}  // namespace phantom::dds
