#include "common/observation/observer.hpp"

#include <mutex>

#include "common/dds/endpoints/participant_impl.hpp"
#include "common/observation/convert.hpp"
#include "common/observation/learn_type.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = fast_dds::rtps;

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
std::string vendor_name(const rtps::VendorId_t& vendor) {
  constexpr const char* kNames[] = {
      nullptr, "RTI Connext", "OpenSplice",  "OpenDDS",  "Mil-DDS", "InterCOM DDS", "CoreDX",
      nullptr, nullptr,       "GurumDDS",    nullptr,    nullptr,   nullptr,        nullptr,
      nullptr, "Fast DDS",    "Cyclone DDS", "GurumDDS", "RustDDS", "Zhenrong DDS", "Dust DDS"};
  if (vendor[0] == 1 && vendor[1] < std::size(kNames) && kNames[vendor[1]] != nullptr)
    return kNames[vendor[1]];
  return "vendor " + std::to_string(vendor[0]) + "." + std::to_string(vendor[1]);
}

diagnostics::ParticipantInfo info_of(const dds::FoundParticipant& found) {
  diagnostics::ParticipantInfo info;
  info.guid = guid_of(found.guid);
  info.name = found.name;
  info.vendor = vendor_name(found.vendor);
  info.lease_ns = duration_ns(found.lease);
  for (const auto& [name, value] : found.properties) {
    if (name == edds::parameter_policy_physical_data_host) info.host = value;
    if (name == edds::parameter_policy_physical_data_user) info.user = value;
    if (name == edds::parameter_policy_physical_data_process) info.process = value;
  }
  for (const auto& locator : found.samples) {
    info.locators.push_back(locator_text(locator));
    if (info.host.empty() && locator.kind == LOCATOR_KIND_UDPv4)
      info.host = rtps::IPLocator::toIPv4string(locator);
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

diagnostics::EndpointQos qos_of(const dds::EndpointPolicies& qos) {
  using namespace diagnostics;
  EndpointQos out;
  out.reliability = qos.reliability.kind == edds::RELIABLE_RELIABILITY_QOS ? Reliability::kReliable
                                                                           : Reliability::kBestEffort;
  out.durability = static_cast<Durability>(qos.durability.kind);
  out.deadline_ns = duration_ns(qos.deadline.period);
  out.latency_budget_ns = duration_ns(qos.latency_budget.duration);
  out.liveliness = static_cast<Liveliness>(qos.liveliness.kind);
  out.lease_ns = duration_ns(qos.liveliness.lease_duration);
  out.ownership =
      qos.ownership.kind == edds::EXCLUSIVE_OWNERSHIP_QOS ? Ownership::kExclusive : Ownership::kShared;
  out.destination_order = qos.destination_order.kind == edds::BY_SOURCE_TIMESTAMP_DESTINATIONORDER_QOS
                              ? DestinationOrder::kBySource
                              : DestinationOrder::kByReception;
  out.access_scope = static_cast<AccessScope>(qos.presentation.access_scope);
  out.coherent_access = qos.presentation.coherent_access;
  out.ordered_access = qos.presentation.ordered_access;
  out.partitions = qos.partitions;
  for (const auto value : qos.representations)
    out.representations.push_back(static_cast<Representation>(value));
  return out;
}

// Both have the same order.
Presence presence_of(dds::Discovered event) { return static_cast<Presence>(event); }

diagnostics::EndpointInfo info_of(const dds::FoundEndpoint& found) {
  diagnostics::EndpointInfo info;
  info.guid = guid_of(found.guid);
  info.writer = found.writer;
  info.topic = found.topic;
  info.type = found.type;
  info.keyed = found.keyed;
  info.user_data = found.user_data;
  info.qos = qos_of(found.policies);
  if (found.writer) info.qos.lifespan_ns = duration_ns(found.policies.lifespan.duration);
  return info;
}

}  // namespace

struct Observer::Discovery : dds::DiscoveryEvents {
  std::mutex mutex;
  DiscoveryListener* listener = nullptr;
  bool asks = false;

  bool asks_for_types() const override { return asks; }
  void on_participant(const dds::FoundParticipant& found) override {
    const std::lock_guard lock(mutex);
    if (listener != nullptr) listener->on_participant(info_of(found), presence_of(found.event));
  }
  void on_endpoint(const dds::FoundEndpoint& found) override {
    if (asks && found.event != dds::Discovered::kLeft) learn_type(found.type, found.described);
    const std::lock_guard lock(mutex);
    if (listener != nullptr) listener->on_endpoint(info_of(found), presence_of(found.event));
  }
};

bool can_ask_for_types() { return fast_dds::kAsksForTypes; }

Observer::Observer(const std::string& component, const core::NetworkOptions& network,
                   DiscoveryListener& listener, bool asks_for_types)
    : discovery_([&] {
        auto discovery = std::make_shared<Discovery>();
        discovery->asks = asks_for_types;
        discovery->listener = &listener;
        return discovery;
      }()),
      participant_(component, network, discovery_),
      machine_(announced_machine(*participant_.impl()->participant)) {}

Observer::~Observer() {
  const std::lock_guard lock(discovery_->mutex);
  discovery_->listener = nullptr;
}

dds::Participant& Observer::participant() { return participant_; }
const std::string& Observer::machine() const { return machine_; }
diagnostics::Guid Observer::guid() const { return guid_of(participant_.impl()->participant->guid()); }

}  // namespace phantom::observation
