#pragma once

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <memory>
#include <utility>

#include "common/dds/arbitration/discovery.hpp"

namespace phantom::fast_dds {

/// Hands on what a participant discovers.
class DiscoveryListener final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  explicit DiscoveryListener(std::shared_ptr<dds::DiscoveryEvents> events) : events_(std::move(events)) {}

 private:
  using Participant = eprosima::fastdds::dds::DomainParticipant;

  void on_participant_discovery(Participant*, rtps::ParticipantDiscoveryInfo&& info) override {
    using Status = rtps::ParticipantDiscoveryInfo;
    dds::FoundParticipant found;
    found.event = info.status == Status::DISCOVERED_PARTICIPANT    ? dds::Discovered::kFound
                  : info.status == Status::CHANGED_QOS_PARTICIPANT ? dds::Discovered::kChanged
                  : info.status == Status::REMOVED_PARTICIPANT     ? dds::Discovered::kLeft
                                                                   : dds::Discovered::kLost;
    const auto& data = info.info;
    found.guid = data.m_guid;
    found.name = data.m_participantName.to_string();
    found.vendor = data.m_VendorId;
    found.lease = data.m_leaseDuration;
    for (auto property = data.m_properties.begin(); property != data.m_properties.end(); ++property)
      found.properties.emplace_back(property->first(), property->second());
    for (const auto& locator : data.metatraffic_locators.unicast) found.announcements.push_back(locator);
    for (const auto* list : {&data.default_locators.unicast, &data.default_locators.multicast})
      found.samples.insert(found.samples.end(), list->begin(), list->end());
    events_->on_participant(found);
  }
  void onParticipantAuthentication(Participant*, rtps::ParticipantAuthenticationInfo&& info) override {
    events_->on_authentication(info.guid,
                               info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT);
  }
  void on_subscriber_discovery(Participant* own, rtps::ReaderDiscoveryInfo&& info) override {
    using Status = rtps::ReaderDiscoveryInfo;
    forward(own, info.info, false, info.status == Status::DISCOVERED_READER,
            info.status == Status::CHANGED_QOS_READER);
  }
  void on_publisher_discovery(Participant* own, rtps::WriterDiscoveryInfo&& info) override {
    using Status = rtps::WriterDiscoveryInfo;
    forward(own, info.info, true, info.status == Status::DISCOVERED_WRITER,
            info.status == Status::CHANGED_QOS_WRITER);
  }

  template <class Data>
  void forward(const Participant* own, const Data& data, bool writer, bool found, bool changed) {
    if (own != nullptr && own->guid().guidPrefix == data.guid().guidPrefix) return;
    const auto& qos = data.m_qos;
    dds::FoundEndpoint endpoint;
    endpoint.event = found     ? dds::Discovered::kFound
                     : changed ? dds::Discovered::kChanged
                               : dds::Discovered::kLeft;
    endpoint.guid = data.guid();
    endpoint.writer = writer;
    endpoint.topic = data.topicName().to_string();
    endpoint.type = data.typeName().to_string();
    endpoint.keyed = data.topicKind() == rtps::WITH_KEY;
    endpoint.policies = {.reliability = qos.m_reliability,
                         .durability = qos.m_durability,
                         .deadline = qos.m_deadline,
                         .latency_budget = qos.m_latencyBudget,
                         .lifespan = qos.m_lifespan,
                         .liveliness = qos.m_liveliness,
                         .ownership = qos.m_ownership,
                         .destination_order = qos.m_destinationOrder,
                         .presentation = qos.m_presentation,
                         .partitions = qos.m_partition.names(),
                         .representations = qos.representation.m_value};
    endpoint.user_data.assign(qos.m_userData.begin(), qos.m_userData.end());
    events_->on_endpoint(endpoint);
  }

  const std::shared_ptr<dds::DiscoveryEvents> events_;
};

}  // namespace phantom::fast_dds
