#include "common/dds/endpoints/qos.hpp"

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include "common/dds/endpoints/participant.hpp"
#include "fast_dds/endpoints.hpp"
#include "fast_dds/types.hpp"

namespace phantom::dds {
namespace {

namespace edds = eprosima::fastdds::dds;
using fast_dds::Duration;

std::string in_milliseconds(const Duration& duration) {
  if (duration == fast_dds::infinite()) return "none";
  return std::to_string(duration.to_ns() / 1'000'000) + " ms";
}

std::string in_milliseconds(int value_ms) {
  return value_ms == 0 ? "none" : std::to_string(value_ms) + " ms";
}

// Compares one endpoint's profile with the topic's contract and reports the first difference.
class ContractCheck {
 public:
  ContractCheck(const TopicDescription& topic, const char* end) : topic_(topic), end_(end) {}

  void same(const char* policy, const std::string& profile, const std::string& contract) const {
    if (profile == contract) return;
    throw DdsError("QoS profile '" + std::string(topic_.name) + "' (" + end_ + "): " + policy + " is " +
                   profile + "; the topic's contract says " + contract);
  }

  template <class Qos>
  void policies(const Qos& qos) const {
    const QosContract& contract = topic_.qos;
    same("reliability", qos.reliability().kind == edds::RELIABLE_RELIABILITY_QOS ? "RELIABLE" : "BEST_EFFORT",
         contract.reliability == Reliability::kReliable ? "RELIABLE" : "BEST_EFFORT");
    same("durability",
         qos.durability().kind == edds::TRANSIENT_LOCAL_DURABILITY_QOS ? "TRANSIENT_LOCAL" : "VOLATILE",
         contract.durability == Durability::kTransientLocal ? "TRANSIENT_LOCAL" : "VOLATILE");
    same("history kind", qos.history().kind == edds::KEEP_LAST_HISTORY_QOS ? "KEEP_LAST" : "KEEP_ALL",
         "KEEP_LAST");
    same("history depth", std::to_string(qos.history().depth), std::to_string(contract.history_depth));
    same("deadline", in_milliseconds(qos.deadline().period), in_milliseconds(contract.deadline_ms));
    same("lifespan", in_milliseconds(qos.lifespan().duration), "none");
    same("liveliness kind",
         qos.liveliness().kind == edds::MANUAL_BY_TOPIC_LIVELINESS_QOS ? "MANUAL_BY_TOPIC" : "AUTOMATIC",
         contract.liveliness_ms > 0 ? "MANUAL_BY_TOPIC" : "AUTOMATIC");
    same("liveliness lease", in_milliseconds(qos.liveliness().lease_duration),
         in_milliseconds(contract.liveliness_ms));
    same("data sharing", qos.data_sharing().kind() == edds::OFF ? "OFF" : "on", "OFF");
  }

 private:
  const TopicDescription& topic_;
  const char* end_;
};

DdsError no_profile(const TopicDescription& topic, const char* end) {
  return DdsError("QoS profiles: no " + std::string(end) + " profile called '" + topic.name +
                  "'; every topic needs a data_writer and a data_reader profile of its name");
}

// What a topic of others asks for, without a profile. Samples of any length are taken: their owners bound
// them.
template <class Qos>
Qos foreign_qos(const TopicDescription& topic) {
  const QosContract& contract = topic.qos;
  Qos qos;
  qos.reliability().kind = contract.reliability == Reliability::kReliable ? edds::RELIABLE_RELIABILITY_QOS
                                                                          : edds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = contract.durability == Durability::kTransientLocal
                              ? edds::TRANSIENT_LOCAL_DURABILITY_QOS
                              : edds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = contract.history_depth > 0 ? edds::KEEP_LAST_HISTORY_QOS : edds::KEEP_ALL_HISTORY_QOS;
  if (contract.history_depth > 0) qos.history().depth = contract.history_depth;
  qos.endpoint().history_memory_policy = fast_dds::rtps::DYNAMIC_RESERVE_MEMORY_MODE;
  qos.data_sharing().off();
  const std::string user_data = topic.user_data;
  qos.user_data().assign(user_data.begin(), user_data.end());
  return qos;
}

}  // namespace

void without_piggyback(edds::DataWriterQos& qos) noexcept {
  qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
}

edds::DataWriterQos writer_qos(edds::Publisher& publisher, const TopicDescription& topic) {
  if (topic.foreign) {
    auto qos = foreign_qos<edds::DataWriterQos>(topic);
    without_piggyback(qos);
    return qos;
  }
  edds::DataWriterQos qos;
  if (!fast_dds::ok(publisher.get_datawriter_qos_from_profile(topic.name, qos))) {
    throw no_profile(topic, "data_writer");
  }
  const ContractCheck check(topic, "data_writer");
  check.policies(qos);
  check.same("publish mode",
             qos.publish_mode().kind == edds::SYNCHRONOUS_PUBLISH_MODE ? "SYNCHRONOUS" : "ASYNCHRONOUS",
             "SYNCHRONOUS");
  without_piggyback(qos);
  return qos;
}

edds::DataReaderQos reader_qos(edds::Subscriber& subscriber, const TopicDescription& topic) {
  if (topic.foreign) {
    auto qos = foreign_qos<edds::DataReaderQos>(topic);
    fast_dds::accept_all_representations(qos);
    return qos;
  }
  edds::DataReaderQos qos;
  if (!fast_dds::ok(subscriber.get_datareader_qos_from_profile(topic.name, qos))) {
    throw no_profile(topic, "data_reader");
  }
  ContractCheck(topic, "data_reader").policies(qos);
  return qos;
}

const char* policy_name(int policy_id) {
  switch (policy_id) {
    case edds::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case edds::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case edds::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case edds::RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case edds::OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case edds::DATAREPRESENTATION_QOS_POLICY_ID:
      return "data representation";
    default:
      return "another policy";
  }
}

}  // namespace phantom::dds
