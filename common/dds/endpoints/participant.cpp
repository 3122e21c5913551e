#include <spdlog/spdlog.h>

#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "common/core/host/host_interfaces.hpp"
#include "common/core/random.hpp"
#include "common/dds/admission/bans.hpp"
#include "common/dds/arbitration/writer_labels.hpp"
#include "common/dds/endpoints/dds_threads.hpp"
#include "common/dds/endpoints/outbox.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/profiles.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/dds/endpoints/security.hpp"
#include "common/dds/endpoints/topic_list.hpp"
#include "common/dds/endpoints/transport.hpp"
#include "common/dds/recovery/rediscovery_manager.hpp"
#include "fast_dds/discovery.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/participants.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = fast_dds::rtps;

std::vector<rtps::Locator_t> locators_of(const std::vector<std::string>& servers) {
  std::vector<rtps::Locator_t> locators;
  for (const std::string& server : servers) {
    const auto colon = server.rfind(':');
    rtps::Locator_t& locator = locators.emplace_back();
    locator.kind = LOCATOR_KIND_UDPv4;
    rtps::IPLocator::setIPv4(locator, server.substr(0, colon));
    locator.port = static_cast<std::uint32_t>(std::stoul(server.substr(colon + 1)));
  }
  return locators;
}

edds::DomainParticipantQos participant_qos(const std::string& component, const core::NetworkOptions& network,
                                           bool observes, bool asks_for_types,
                                           const std::shared_ptr<GuardedTransportDescriptor>& transport) {
  edds::DomainParticipantQos qos = edds::PARTICIPANT_QOS_DEFAULT;
  qos.name(component);
  qos.user_data().assign(network.user_data.begin(), network.user_data.end());
  fast_dds::ask_for_types(qos, asks_for_types);
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
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
    fast_dds::use_discovery_servers(discovery, locators_of(network.discovery_servers), observes);
  if (!network.security.empty()) {
    for (const auto& [name, value] : security_properties(network.security, component))
      qos.properties().properties().emplace_back(name, value);
  }
  return qos;
}

enum class Joins { kNow, kNever };

// Creates every participant of the process, one at a time: whether a participant joins is a setting of the
// factory, which all threads share. Returns null if Fast DDS refuses.
// Samples between participants of one process take the transport: delivered by call, an announcement can
// reach a reader that its participant has destroyed, which ends the process (Fast DDS pull request 5034).
edds::DomainParticipant* make_participant(int domain, const edds::DomainParticipantQos& qos,
                                          edds::DomainParticipantListener* listener, Joins joins) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  static const bool by_transport = (fast_dds::deliver_by_transport(), true);
  (void)by_transport;
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
  std::erase_if(counters, [](const auto& each) { return each.use_count() == 1; });  // its endpoint has ended
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
                         std::shared_ptr<DiscoveryEvents> discovery)
    : impl_(std::make_shared<Impl>()) {
  if (!network.qos_profiles.empty()) check_qos_profiles(network.qos_profiles);
  core::require_interfaces(network, core::host_interfaces());
  impl_->component = component;
  impl_->servo_priority = network.servo_priority;
  impl_->session = core::random_number();
  const bool observes = discovery != nullptr;
  const bool asks_for_types = observes && discovery->asks_for_types();
  const auto transport = transport_of(network, observes, asks_for_types);
  impl_->refused = transport->refused;
  impl_->outbox = transport->outbox;
  impl_->bans = transport->bans;
  if (network.discovery_servers.empty()) {  // with discovery servers, a peer's end is reported by others
    discovery = impl_->readmission = std::make_shared<RediscoveryManager>(
        component, !network.security.empty(), transport->outbox, transport->announcements, transport->gaps,
        transport->leases, discovery);
  }
  impl_->model_label = network.model_label;
  if (!network.security.empty()) impl_->documents_end = dds::documents_end(network.security, component);
  impl_->labels = std::make_shared<WriterLabels>(std::move(discovery));
  impl_->listener = std::make_shared<fast_dds::DiscoveryListener>(impl_->labels);
  with_dds_threads(network.servo_priority > 0, [&] {
    impl_->participant = make_participant(
        network.domain, participant_qos(component, network, observes, asks_for_types, transport),
        impl_->listener.get(), Joins::kNow);
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

std::array<std::uint8_t, 16> octets_of(const rtps::GUID_t& guid) {
  std::array<std::uint8_t, 16> octets;
  std::copy_n(guid.entityId.value, 4, std::copy_n(guid.guidPrefix.value, 12, octets.begin()));
  return octets;
}

void delete_writer(edds::Publisher& publisher, edds::DataWriter* writer) {
  if constexpr (fast_dds::kFreesSamplesInUse) {
    std::size_t removed = 0;
    writer->clear_history(&removed);
  }
  publisher.delete_datawriter(writer);
}

const std::string& Participant::component() const { return impl_->component; }
std::uint64_t Participant::session() const { return impl_->session; }
int Participant::servo_priority() const { return impl_->servo_priority; }

std::vector<Refused> Participant::refused_datagrams() const { return impl_->refused->list(); }

void Participant::log_refused_datagrams() { impl_->refused->log(impl_->component, core::monotonic_ns()); }

void Participant::suspend(const GuidPrefix& other) {
  if (impl_->bans->holds(other)) return;
  if (impl_->readmission) impl_->readmission->leave(other);
  impl_->bans->suspend(other);
}
const std::optional<DocumentsEnd>& Participant::documents_end() const { return impl_->documents_end; }
bool Participant::resume() { return impl_->bans->resume(); }

std::string Participant::half_known_peer() const {
  return impl_->readmission ? impl_->readmission->half_known() : "";
}

std::uint64_t Participant::forgotten() const {
  return impl_->outbox->forgotten() + impl_->bans->forgotten() +
         (impl_->readmission ? impl_->readmission->forgotten() : 0);
}

std::vector<core::EndpointStatistics> Participant::endpoints() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<core::EndpointStatistics> statistics;
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
