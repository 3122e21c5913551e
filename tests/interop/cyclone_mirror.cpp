#include "tests/interop/cyclone_mirror.hpp"

#include <stdexcept>

#include "tests/interop/cyclone_topics.h"

namespace phantom::interop {
namespace {

// Loopback alone; peers by address, so that it depends on no multicast.
constexpr const char* kConfiguration =
    "<CycloneDDS><Domain id='any'><General><Interfaces><NetworkInterface address='127.0.0.1' "
    "multicast='false'/></Interfaces><AllowMulticast>false</AllowMulticast><MaxMessageSize>65000B</MaxMessageSize></General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>";

std::int32_t made(std::int32_t entity, const std::string& what) {
  if (entity < 0) throw std::runtime_error("Cyclone DDS: " + what + ": " + dds_strretcode(-entity));
  return entity;
}

const dds_topic_descriptor_t* descriptor_of(const std::string& type) {
  for (const cyclone_type* known = cyclone_types; known->name != nullptr; ++known) {
    if (type == known->name) return known->descriptor;
  }
  throw std::runtime_error(type + ": not generated for Cyclone DDS");
}

std::int32_t participant_in(int domain) {
  dds_create_domain(static_cast<dds_domainid_t>(domain), kConfiguration);  // fails harmlessly if it is there
  return made(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr), "participant");
}

// The contract of idl/README.md's table, in the other vendor's words.
dds_qos_t* qos_of(const dds::QosContract& contract) {
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos,
                       contract.reliability == dds::Reliability::kReliable ? DDS_RELIABILITY_RELIABLE
                                                                           : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_SECS(10));
  dds_qset_durability(qos, contract.durability == dds::Durability::kTransientLocal
                               ? DDS_DURABILITY_TRANSIENT_LOCAL
                               : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, contract.history_depth);
  if (contract.deadline_ms > 0) dds_qset_deadline(qos, DDS_MSECS(contract.deadline_ms));
  if (contract.liveliness_ms > 0)
    dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(contract.liveliness_ms));
  const dds_data_representation_id_t plain_cdr = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &plain_cdr);
  return qos;
}

}  // namespace

CycloneMirror::CycloneMirror(const dds::TopicDescription& topic, int from_domain, int to_domain)
    : from_(participant_in(from_domain)), to_(participant_in(to_domain)) {
  const dds_topic_descriptor_t* type = descriptor_of(topic.type_name);
  dds_qos_t* qos = qos_of(topic.qos);
  reader_ = made(
      dds_create_reader(from_, made(dds_create_topic(from_, type, topic.name, nullptr, nullptr), "topic"),
                        qos, nullptr),
      "reader");
  writer_ =
      made(dds_create_writer(to_, made(dds_create_topic(to_, type, topic.name, nullptr, nullptr), "topic"),
                             qos, nullptr),
           "writer");
  dds_delete_qos(qos);
  thread_ = std::thread([this] { run(); });
}

CycloneMirror::~CycloneMirror() {
  stop_ = true;
  thread_.join();
  dds_delete(from_);
  dds_delete(to_);
}

bool CycloneMirror::connected() const {
  dds_subscription_matched_status_t heard{};
  dds_publication_matched_status_t hearing{};
  dds_get_subscription_matched_status(reader_, &heard);
  dds_get_publication_matched_status(writer_, &hearing);
  return heard.current_count > 0 && hearing.current_count > 0;
}

void CycloneMirror::run() {
  const dds_entity_t waitset = dds_create_waitset(from_);
  const dds_entity_t condition = dds_create_readcondition(reader_, DDS_ANY_STATE);
  dds_waitset_attach(waitset, condition, 0);
  while (!stop_) {
    dds_waitset_wait(waitset, nullptr, 0, DDS_MSECS(50));
    void* sample[1] = {nullptr};  // Cyclone DDS lends its own
    dds_sample_info_t info;
    while (dds_take(reader_, sample, &info, 1, 1) == 1) {
      if (info.valid_data && dds_write(writer_, sample[0]) == DDS_RETCODE_OK) ++mirrored_;
      dds_return_loan(reader_, sample, 1);
    }
  }
  dds_delete(waitset);
}

}  // namespace phantom::interop
