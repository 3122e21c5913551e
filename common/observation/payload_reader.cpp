#include "common/observation/payload_reader.hpp"

#include <atomic>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "common/dds/participant_impl.hpp"
#include "common/observation/convert.hpp"
#include "common/observation/payload_type.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<std::uint8_t>;

edds::DataReaderQos reader_qos(const PayloadQos& given) {
  edds::DataReaderQos qos = edds::DATAREADER_QOS_DEFAULT;
  qos.reliability().kind =
      given.reliable ? edds::RELIABLE_RELIABILITY_QOS : edds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      given.transient_local ? edds::TRANSIENT_LOCAL_DURABILITY_QOS : edds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = given.depth == 0 ? edds::KEEP_ALL_HISTORY_QOS : edds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = std::max(given.depth, 1);
  qos.resource_limits().max_samples = 0;  // no limit: the history's depth is the limit
  qos.resource_limits().max_instances = 0;
  qos.resource_limits().max_samples_per_instance = 0;
  qos.resource_limits().allocated_samples = 16;
  qos.liveliness().kind = static_cast<edds::LivelinessQosPolicyKind>(given.liveliness);
  qos.liveliness().lease_duration = duration_of(given.lease_ns);
  qos.ownership().kind = given.ownership == diagnostics::Ownership::kExclusive ? edds::EXCLUSIVE_OWNERSHIP_QOS
                                                                               : edds::SHARED_OWNERSHIP_QOS;
  qos.type_consistency().representation.m_value = {edds::XCDR_DATA_REPRESENTATION,
                                                   edds::XCDR2_DATA_REPRESENTATION};
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.reliable_reader_qos().times.initialAcknackDelay = {0, 0};
  qos.reliable_reader_qos().times.heartbeatResponseDelay = {0, 0};
  qos.data_sharing().off();
  return qos;
}

/// Registers the payload type of that name with the participant at its first topic. Returns false if the type
/// is known with other properties, or Fast DDS refuses it.
bool register_type(edds::DomainParticipant& participant, const PayloadTopic& topic) {
  const edds::TypeSupport known = participant.find_type(topic.type);
  if (!known.empty())
    return dynamic_cast<PayloadType*>(known.get()) != nullptr && known->m_isGetKeyDefined == topic.keyed;
  const edds::TypeSupport type(new PayloadType(topic.type, topic.keyed));
  return type.register_type(&participant, topic.type) == ReturnCode_t::RETCODE_OK;
}

InstanceState state_of(edds::InstanceStateKind kind) {
  if (kind == edds::NOT_ALIVE_DISPOSED_INSTANCE_STATE) return InstanceState::kDisposed;
  return kind == edds::ALIVE_INSTANCE_STATE ? InstanceState::kAlive : InstanceState::kNoWriters;
}

}  // namespace

struct PayloadReader::Impl : edds::DataReaderListener {
  Impl(dds::Participant& of, PayloadListener& told) : participant(of.impl()), listener(told) {}

  std::shared_ptr<dds::Participant::Impl> participant;
  PayloadListener& listener;
  edds::Subscriber* subscriber = nullptr;
  edds::Topic* topic = nullptr;
  edds::DataReader* reader = nullptr;
  Bytes bytes;  // reused: DDS calls a reader's listener from one thread at a time
  std::atomic<std::uint32_t> matched{0};
  std::atomic<std::uint64_t> rejected{0}, lost{0};

  void open(const PayloadTopic& described, const PayloadQos& qos) {
    auto* of = participant->participant;
    edds::SubscriberQos where = edds::SUBSCRIBER_QOS_DEFAULT;
    std::vector<std::string> partitions{"", "*"};
    if (!qos.partition.empty()) partitions = {qos.partition};
    where.partition().names(partitions);
    topic = register_type(*of, described)
                ? of->create_topic(described.name, described.type, edds::TOPIC_QOS_DEFAULT)
                : nullptr;
    subscriber = topic != nullptr ? of->create_subscriber(where) : nullptr;
    reader = subscriber != nullptr ? subscriber->create_datareader(topic, reader_qos(qos), this) : nullptr;
    if (reader != nullptr) return;
    close();
    throw dds::DdsError("topic " + described.name + ": Fast DDS refused a reader of " + described.type +
                        (described.keyed ? " (with key)" : " (without key)"));
  }

  void close() {
    if (reader != nullptr) {
      reader->set_listener(nullptr);  // waits for a call in progress
      subscriber->delete_datareader(reader);
    }
    if (subscriber != nullptr) participant->participant->delete_subscriber(subscriber);
    if (topic != nullptr) participant->participant->delete_topic(topic);
  }

  void on_data_available(edds::DataReader* from) override {
    edds::SampleInfo info;
    while (from->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK) {
      Payload payload;
      if (info.valid_data) payload.bytes = bytes;
      payload.writer = guid_of(info.sample_identity.writer_guid());
      payload.sequence_number = info.sample_identity.sequence_number().to64long();
      payload.source_ns = info.source_timestamp.to_ns();
      payload.received_ns = core::monotonic_ns();
      payload.received_utc_ns = core::utc_ns();
      payload.instance = state_of(info.instance_state);
      listener.on_payload(payload);
    }
  }
  void on_subscription_matched(edds::DataReader*, const edds::SubscriptionMatchedStatus& status) override {
    matched = static_cast<std::uint32_t>(status.current_count);
  }
  void on_sample_rejected(edds::DataReader*,
                          const eprosima::fastrtps::SampleRejectedStatus& status) override {
    rejected = static_cast<std::uint64_t>(status.total_count);
  }
  void on_sample_lost(edds::DataReader*, const edds::SampleLostStatus& status) override {
    lost = static_cast<std::uint64_t>(status.total_count);
  }
  void on_liveliness_changed(edds::DataReader*,
                             const eprosima::fastrtps::LivelinessChangedStatus& status) override {
    if (status.alive_count_change == 0 && status.not_alive_count_change == 0) return;
    rtps::GUID_t writer;
    rtps::iHandle2GUID(writer, status.last_publication_handle);
    // A writer that ends in an orderly way lowers the count of alive writers without raising that of writers
    // not alive. Discovery reports that case.
    if (status.not_alive_count_change > 0) listener.on_liveliness(guid_of(writer), false);
    if (status.alive_count_change > 0) listener.on_liveliness(guid_of(writer), true);
  }
};

PayloadReader::PayloadReader(dds::Participant& participant, const PayloadTopic& topic, const PayloadQos& qos,
                             PayloadListener& listener)
    : impl_(std::make_unique<Impl>(participant, listener)) {
  impl_->open(topic, qos);
}

PayloadReader::~PayloadReader() { impl_->close(); }

std::uint32_t PayloadReader::matched() const { return impl_->matched; }
std::uint64_t PayloadReader::rejected() const { return impl_->rejected; }
std::uint64_t PayloadReader::lost() const { return impl_->lost; }

}  // namespace phantom::observation
