#include "common/observation/observer.hpp"

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>
#include <fastrtps/utils/IPLocator.h>

#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <mutex>

#include "common/dds/participant_impl.hpp"
#include "common/observation/convert.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

std::string locator_text(const rtps::Locator_t& locator) {
  const std::string port = std::to_string(rtps::IPLocator::getPhysicalPort(locator));
  switch (locator.kind) {
    case LOCATOR_KIND_UDPv4:
      return "UDPv4 " + rtps::IPLocator::toIPv4string(locator) + ":" + port;
    case LOCATOR_KIND_TCPv4:
      return "TCPv4 " + rtps::IPLocator::toIPv4string(locator) + ":" + port;
    case LOCATOR_KIND_UDPv6:
      return "UDPv6 [" + rtps::IPLocator::toIPv6string(locator) + "]:" + port;
    case LOCATOR_KIND_TCPv6:
      return "TCPv6 [" + rtps::IPLocator::toIPv6string(locator) + "]:" + port;
    case LOCATOR_KIND_SHM:
      return "SHM :" + std::to_string(locator.port);
    default:
      return "transport " + std::to_string(locator.kind);
  }
}

// From the OMG's list of DDS-RTPS vendor identifiers.
std::string vendor_name(const eprosima::fastdds::rtps::VendorId_t& vendor) {
  constexpr const char* kNames[] = {
      nullptr, "RTI Connext", "OpenSplice",  "OpenDDS",  "Mil-DDS", "InterCOM DDS", "CoreDX",
      nullptr, nullptr,       "GurumDDS",    nullptr,    nullptr,   nullptr,        nullptr,
      nullptr, "Fast DDS",    "Cyclone DDS", "GurumDDS", "RustDDS", "Zhenrong DDS", "Dust DDS"};
  if (vendor[0] == 1 && vendor[1] < std::size(kNames) && kNames[vendor[1]] != nullptr)
    return kNames[vendor[1]];
  return "vendor " + std::to_string(vendor[0]) + "." + std::to_string(vendor[1]);
}

diagnostics::ParticipantInfo info_of(const rtps::ParticipantProxyData& data) {
  diagnostics::ParticipantInfo info;
  info.guid = guid_of(data.m_guid);
  info.name = data.m_participantName.to_string();
  info.vendor = vendor_name(data.m_VendorId);
  info.lease_ns = duration_ns(data.m_leaseDuration);
  for (auto property = data.m_properties.begin(); property != data.m_properties.end(); ++property) {
    if (property->first() == edds::parameter_policy_physical_data_host) info.host = property->second();
    if (property->first() == edds::parameter_policy_physical_data_user) info.user = property->second();
    if (property->first() == edds::parameter_policy_physical_data_process) info.process = property->second();
  }
  for (const auto* list : {&data.default_locators.unicast, &data.default_locators.multicast}) {
    for (const auto& locator : *list) {
      info.locators.push_back(locator_text(locator));
      if (info.host.empty() && locator.kind == LOCATOR_KIND_UDPv4)
        info.host = rtps::IPLocator::toIPv4string(locator);
    }
  }
  info.machine = info.host;
  info.host = info.host.substr(0, info.host.find(':'));  // Fast DDS announces "name:number of the machine"
  return info;
}

std::string announced_machine(const edds::DomainParticipant& participant) {
  for (const auto& property : participant.get_qos().properties().properties()) {
    if (property.name() == edds::parameter_policy_physical_data_host) return property.value();
  }
  return "";
}

// The policies whose members have the same names in WriterQos and ReaderQos.
template <class Qos>
diagnostics::EndpointQos common_qos(const Qos& qos) {
  using namespace diagnostics;
  EndpointQos out;
  out.reliability = qos.m_reliability.kind == edds::RELIABLE_RELIABILITY_QOS ? Reliability::kReliable
                                                                             : Reliability::kBestEffort;
  out.durability = static_cast<Durability>(qos.m_durability.kind);
  out.deadline_ns = duration_ns(qos.m_deadline.period);
  out.latency_budget_ns = duration_ns(qos.m_latencyBudget.duration);
  out.liveliness = static_cast<Liveliness>(qos.m_liveliness.kind);
  out.lease_ns = duration_ns(qos.m_liveliness.lease_duration);
  out.ownership =
      qos.m_ownership.kind == edds::EXCLUSIVE_OWNERSHIP_QOS ? Ownership::kExclusive : Ownership::kShared;
  out.destination_order = qos.m_destinationOrder.kind == edds::BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS
                              ? DestinationOrder::kBySource
                              : DestinationOrder::kByReception;
  out.access_scope = static_cast<AccessScope>(qos.m_presentation.access_scope);
  out.coherent_access = qos.m_presentation.coherent_access;
  out.ordered_access = qos.m_presentation.ordered_access;
  out.partitions = qos.m_partition.names();
  return out;
}

std::vector<diagnostics::Representation> representations(const edds::DataRepresentationQosPolicy& qos) {
  std::vector<diagnostics::Representation> out;
  for (const auto value : qos.m_value) out.push_back(static_cast<diagnostics::Representation>(value));
  return out;
}

template <class ProxyData>
diagnostics::EndpointInfo endpoint_info(const ProxyData& data, bool writer) {
  diagnostics::EndpointInfo info;
  info.guid = guid_of(data.guid());
  info.writer = writer;
  info.topic = data.topicName().to_string();
  info.type = data.typeName().to_string();
  info.keyed = data.topicKind() == rtps::WITH_KEY;
  info.qos = common_qos(data.m_qos);
  return info;
}

}  // namespace

struct Observer::Ear : edds::DomainParticipantListener {
  std::mutex mutex;
  DiscoveryListener* listener = nullptr;

  template <class Notify>
  void notify(Notify&& what) {
    const std::lock_guard lock(mutex);
    if (listener != nullptr) what(*listener);
  }
  static bool is_own(const edds::DomainParticipant* participant, const rtps::GUID_t& endpoint) {
    return participant != nullptr && participant->guid().guidPrefix == endpoint.guidPrefix;
  }

  void on_participant_discovery(edds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& info) override {
    using Status = rtps::ParticipantDiscoveryInfo;
    const Presence presence = info.status == Status::DISCOVERED_PARTICIPANT    ? Presence::kAppeared
                              : info.status == Status::CHANGED_QOS_PARTICIPANT ? Presence::kChanged
                              : info.status == Status::REMOVED_PARTICIPANT     ? Presence::kLeft
                                                                               : Presence::kLost;
    notify([&](DiscoveryListener& to) { to.on_participant(info_of(info.info), presence); });
  }
  void on_publisher_discovery(edds::DomainParticipant* participant,
                              rtps::WriterDiscoveryInfo&& info) override {
    if (is_own(participant, info.info.guid())) return;
    using Status = rtps::WriterDiscoveryInfo;
    auto endpoint = endpoint_info(info.info, true);
    endpoint.qos.lifespan_ns = duration_ns(info.info.m_qos.m_lifespan.duration);
    endpoint.qos.representations = representations(info.info.m_qos.representation);
    const Presence presence = info.status == Status::DISCOVERED_WRITER    ? Presence::kAppeared
                              : info.status == Status::CHANGED_QOS_WRITER ? Presence::kChanged
                                                                          : Presence::kLeft;
    notify([&](DiscoveryListener& to) { to.on_endpoint(endpoint, presence); });
  }
  void on_subscriber_discovery(edds::DomainParticipant* participant,
                               rtps::ReaderDiscoveryInfo&& info) override {
    if (is_own(participant, info.info.guid())) return;
    using Status = rtps::ReaderDiscoveryInfo;
    auto endpoint = endpoint_info(info.info, false);
    endpoint.qos.representations = representations(info.info.m_qos.representation);
    const Presence presence = info.status == Status::DISCOVERED_READER    ? Presence::kAppeared
                              : info.status == Status::CHANGED_QOS_READER ? Presence::kChanged
                                                                          : Presence::kLeft;
    notify([&](DiscoveryListener& to) { to.on_endpoint(endpoint, presence); });
  }
};

Observer::Observer(const std::string& component, const core::NetworkOptions& network,
                   DiscoveryListener& listener)
    : ear_([&] {
        auto ear = std::make_shared<Ear>();
        ear->listener = &listener;
        return ear;
      }()),
      participant_(component, network, ear_),
      machine_(announced_machine(*participant_.impl()->participant)) {}

Observer::~Observer() {
  const std::lock_guard lock(ear_->mutex);
  ear_->listener = nullptr;
}

dds::Participant& Observer::participant() { return participant_; }
const std::string& Observer::machine() const { return machine_; }
diagnostics::Guid Observer::guid() const { return guid_of(participant_.impl()->participant->guid()); }

}  // namespace phantom::observation
