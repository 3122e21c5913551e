#include "common/observation/payload_reader.hpp"

#include <algorithm>
#include <atomic>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <optional>

#include "common/dds/arbitration/reader_quota.hpp"
#include "common/dds/endpoints/cdr.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/observation/convert.hpp"
#include "common/observation/payload_type.hpp"
#include "fast_dds/endpoints.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
namespace rtps = fast_dds::rtps;

/// Returns the project's topic of that name and type; null: a topic of somebody else.
const dds::TopicDescription* own_topic(const PayloadTopic& topic) {
  const dds::TopicDescription* named = dds::topic_named(topic.name);
  return named != nullptr && topic.type == named->type_name ? named : nullptr;
}

/// Returns how many instances a reader of that keyed topic may have.
std::size_t instances_of(edds::Subscriber& subscriber, const PayloadTopic& topic) {
  const dds::TopicDescription* own = own_topic(topic);
  if (own == nullptr) return PayloadReader::kForeignInstances;
  try {
    const int profile = dds::reader_qos(subscriber, *own).resource_limits().max_instances;
    return std::max(PayloadReader::kMinInstances, static_cast<std::size_t>(std::max(0, profile)));
  } catch (const dds::DdsError&) {  // the profiles lack it: an ill for those who use the topic
    return PayloadReader::kForeignInstances;
  }
}

edds::DataReaderQos reader_qos(const diagnostics::EndpointQos& given, int depth, std::size_t instances) {
  edds::DataReaderQos qos = edds::DATAREADER_QOS_DEFAULT;
  set_policies(qos, given, depth);
  qos.resource_limits().max_instances = static_cast<std::int32_t>(instances);
  fast_dds::accept_all_representations(qos);
  fast_dds::ask_at_once(qos);
  return qos;
}

InstanceState state_of(edds::InstanceStateKind kind) {
  if (kind == edds::NOT_ALIVE_DISPOSED_INSTANCE_STATE) return InstanceState::kDisposed;
  return kind == edds::ALIVE_INSTANCE_STATE ? InstanceState::kAlive : InstanceState::kNoWriters;
}

}  // namespace

struct PayloadReader::Impl : edds::DataReaderListener {
  Impl(dds::Participant& of, PayloadListener& to) : participant(of.impl()), listener(to) {}

  std::shared_ptr<dds::Participant::Impl> participant;
  PayloadListener& listener;
  edds::Subscriber* subscriber = nullptr;
  edds::Topic* topic = nullptr;
  edds::DataReader* reader = nullptr;
  SerializedSample sample;  // reused: DDS calls a reader's listener from one thread at a time
  std::atomic<std::uint32_t> matched{0};
  std::atomic<std::uint64_t> rejected{0}, lost{0};
  std::unique_ptr<dds::ReaderQuota> census;  // of a keyed topic
  std::optional<dds::CdrCodec> codec;        // likewise, if it is the project's

  void open(const PayloadTopic& described, const diagnostics::EndpointQos& qos, int depth) {
    auto* of = participant->participant;
    std::size_t instances = 1;
    if (described.keyed) {
      instances = instances_of(*participant->subscriber, described);
      census = std::make_unique<dds::ReaderQuota>(participant->component, described.name,
                                                  dds::ReaderQuota::most_keys(instances), participant->bans);
      if (const auto* own = own_topic(described)) codec.emplace(*own);
    }
    edds::SubscriberQos where = edds::SUBSCRIBER_QOS_DEFAULT;
    const std::vector<std::string> all{"", "*"};
    auto partitions = qos.partitions.empty() ? all : qos.partitions;
    where.partition().names(partitions);
    topic = register_type(*of, described)
                ? of->create_topic(described.name, described.type, edds::TOPIC_QOS_DEFAULT)
                : nullptr;
    subscriber = topic != nullptr ? of->create_subscriber(where) : nullptr;
    if (subscriber != nullptr)
      reader = subscriber->create_datareader(topic, reader_qos(qos, depth, instances), this);
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
    if (topic == nullptr) return;
    const std::string type = topic->get_type_name();
    participant->participant->delete_topic(topic);
    participant->participant->unregister_type(type);  // stays where another topic has it
  }

  void on_data_available(edds::DataReader* from) override {
    edds::SampleInfo info;
    while (fast_dds::ok(from->take_next_sample(&sample, &info))) {
      if (census && !admits(info)) continue;
      Payload payload;
      if (info.valid_data) payload.bytes = sample.bytes;
      payload.writer = guid_of(info.sample_identity.writer_guid());
      payload.sequence_number = info.sample_identity.sequence_number().to64long();
      payload.source_ns = info.source_timestamp.to_ns();
      payload.received_ns = core::monotonic_ns();
      payload.received_utc_ns = core::utc_ns();
      payload.instance = state_of(info.instance_state);
      listener.on_payload(payload);
    }
  }
  /// Takes note of the sample's keys: the one that it was sent with and, of the project's types, the one in
  /// its bytes. They differ if the sender lies. Returns false if nothing is taken from the sender any more.
  bool admits(const edds::SampleInfo& info) {
    const dds::GuidPrefix writer = dds::prefix_of(info.sample_identity.writer_guid());
    dds::InstanceKey sent, own;
    std::copy_n(static_cast<const std::uint8_t*>(info.instance_handle.value), sent.size(), sent.begin());
    if (sent != SerializedSample().instance) census->note(writer, sent);
    if (codec && info.valid_data && codec->instance_of(sample.bytes, own)) census->note(writer, own);
    return !census->bans(writer);
  }
  void on_subscription_matched(edds::DataReader*, const edds::SubscriptionMatchedStatus& status) override {
    matched = static_cast<std::uint32_t>(status.current_count);
    if (!census || status.current_count_change >= 0) return;
    rtps::GUID_t writer;
    rtps::iHandle2GUID(writer, status.last_publication_handle);
    census->forget(dds::prefix_of(writer));
  }
  void on_sample_rejected(edds::DataReader*, const edds::SampleRejectedStatus& status) override {
    rejected = static_cast<std::uint64_t>(status.total_count);
  }
  void on_sample_lost(edds::DataReader*, const edds::SampleLostStatus& status) override {
    lost = static_cast<std::uint64_t>(status.total_count);
  }
  void on_liveliness_changed(edds::DataReader*, const edds::LivelinessChangedStatus& status) override {
    if (status.alive_count_change == 0 && status.not_alive_count_change == 0) return;
    rtps::GUID_t writer;
    rtps::iHandle2GUID(writer, status.last_publication_handle);
    // A writer that ends in an orderly way lowers the count of alive writers without raising that of writers
    // not alive. Discovery reports that case.
    if (status.not_alive_count_change > 0) listener.on_liveliness(guid_of(writer), false);
    if (status.alive_count_change > 0) listener.on_liveliness(guid_of(writer), true);
  }
};

PayloadReader::PayloadReader(dds::Participant& participant, const PayloadTopic& topic,
                             const diagnostics::EndpointQos& qos, PayloadListener& listener, int depth)
    : impl_(std::make_unique<Impl>(participant, listener)) {
  impl_->open(topic, qos, depth);
}

PayloadReader::~PayloadReader() { impl_->close(); }

std::uint32_t PayloadReader::matched() const { return impl_->matched; }
std::uint64_t PayloadReader::rejected() const { return impl_->rejected; }
std::uint64_t PayloadReader::lost() const { return impl_->lost; }

}  // namespace phantom::observation
