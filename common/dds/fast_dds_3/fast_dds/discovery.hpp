#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/rtps/builtin/data/ParticipantBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/PublicationBuiltinTopicData.hpp>
#include <fastdds/rtps/builtin/data/SubscriptionBuiltinTopicData.hpp>
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

  void on_participant_discovery(Participant*, rtps::ParticipantDiscoveryStatus status,
                                const rtps::ParticipantBuiltinTopicData& data, bool& ignore) override {
    using Status = rtps::ParticipantDiscoveryStatus;
    ignore = false;
    dds::FoundParticipant found;
    found.event = status == Status::DISCOVERED_PARTICIPANT    ? dds::Discovered::kFound
                  : status == Status::CHANGED_QOS_PARTICIPANT ? dds::Discovered::kChanged
                  : status == Status::REMOVED_PARTICIPANT     ? dds::Discovered::kLeft
                                                              : dds::Discovered::kLost;
    found.guid = data.guid;
    found.name = data.participant_name.to_string();
    found.vendor = data.vendor_id;
    found.lease = data.lease_duration;
    for (auto property = data.properties.begin(); property != data.properties.end(); ++property)
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
  void on_data_reader_discovery(Participant* own, rtps::ReaderDiscoveryStatus status,
                                const rtps::SubscriptionBuiltinTopicData& data, bool& ignore) override {
    using Status = rtps::ReaderDiscoveryStatus;
    ignore = false;
    forward(own, data, false, status == Status::DISCOVERED_READER, status == Status::CHANGED_QOS_READER);
  }
  void on_data_writer_discovery(Participant* own, rtps::WriterDiscoveryStatus status,
                                const rtps::PublicationBuiltinTopicData& data, bool& ignore) override {
    using Status = rtps::WriterDiscoveryStatus;
    ignore = false;
    forward(own, data, true, status == Status::DISCOVERED_WRITER, status == Status::CHANGED_QOS_WRITER);
  }

  template <class Data>
  void forward(const Participant* own, const Data& data, bool writer, bool found, bool changed) {
    if (own != nullptr && own->guid().guidPrefix == data.guid.guidPrefix) return;
    dds::FoundEndpoint endpoint;
    endpoint.event = found     ? dds::Discovered::kFound
                     : changed ? dds::Discovered::kChanged
                               : dds::Discovered::kLeft;
    endpoint.guid = data.guid;
    endpoint.writer = writer;
    endpoint.topic = data.topic_name.to_string();
    endpoint.type = data.type_name.to_string();
    if (data.type_information.assigned())
      endpoint.described = data.type_information.type_information.complete().typeid_with_size().type_id();
    endpoint.keyed = data.topic_kind == rtps::WITH_KEY;
    endpoint.policies = {.reliability = data.reliability,
                         .durability = data.durability,
                         .deadline = data.deadline,
                         .latency_budget = data.latency_budget,
                         .lifespan = data.lifespan,
                         .liveliness = data.liveliness,
                         .ownership = data.ownership,
                         .destination_order = data.destination_order,
                         .presentation = data.presentation,
                         .partitions = data.partition.names(),
                         .representations = data.representation.m_value};
    endpoint.user_data.assign(data.user_data.begin(), data.user_data.end());
    events_->on_endpoint(endpoint);
  }

  const std::shared_ptr<dds::DiscoveryEvents> events_;
};

}  // namespace phantom::fast_dds
