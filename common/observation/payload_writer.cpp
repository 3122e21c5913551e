#include "common/observation/payload_writer.hpp"

#include <fastdds/rtps/common/InstanceHandle.h>

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <mutex>

#include "common/dds/participant_impl.hpp"
#include "common/dds/qos.hpp"
#include "common/observation/convert.hpp"
#include "common/observation/payload_type.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;
using Bytes = std::vector<std::uint8_t>;

/// A payload type that finds the key of a sample.
class KeyedPayloadType : public PayloadType {
 public:
  KeyedPayloadType(const std::string& name, PayloadWriter::InstanceOf instance_of)
      : PayloadType(name, true), instance_of_(std::move(instance_of)) {}
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool) override {
    std::array<std::uint8_t, 16> instance{};
    if (!instance_of_(*static_cast<const Bytes*>(data), instance)) return false;
    for (std::size_t i = 0; i < instance.size(); ++i) handle->value[i] = instance[i];
    return true;
  }

 private:
  PayloadWriter::InstanceOf instance_of_;
};

edds::DataWriterQos writer_qos(const diagnostics::EndpointQos& given, int depth) {
  edds::DataWriterQos qos = edds::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = given.reliability == diagnostics::Reliability::kReliable
                               ? edds::RELIABLE_RELIABILITY_QOS
                               : edds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = given.durability == diagnostics::Durability::kVolatile
                              ? edds::VOLATILE_DURABILITY_QOS
                              : edds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = edds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  qos.resource_limits().max_samples = 0;  // no limit: the history's depth is the limit
  qos.resource_limits().max_instances = 0;
  qos.resource_limits().max_samples_per_instance = 0;
  qos.resource_limits().allocated_samples = 16;
  qos.deadline().period = duration_of(given.deadline_ns);
  qos.lifespan().duration = duration_of(given.lifespan_ns);
  qos.liveliness().kind = static_cast<edds::LivelinessQosPolicyKind>(given.liveliness);
  qos.liveliness().lease_duration = duration_of(given.lease_ns);
  // The writer must assert it more often than the lease.
  if (given.lease_ns != diagnostics::kInfinite_ns)
    qos.liveliness().announcement_period = duration_of(given.lease_ns / 3);
  qos.ownership().kind = given.ownership == diagnostics::Ownership::kExclusive ? edds::EXCLUSIVE_OWNERSHIP_QOS
                                                                               : edds::SHARED_OWNERSHIP_QOS;
  qos.publish_mode().kind = edds::SYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, 50'000'000};
  qos.reliable_writer_qos().times.nackResponseDelay = {0, 0};
  qos.data_sharing().off();
  dds::without_piggyback(qos);
  return qos;
}

}  // namespace

struct PayloadWriter::Impl : edds::DataWriterListener {
  std::shared_ptr<dds::Participant::Impl> participant;
  edds::Publisher* publisher = nullptr;
  edds::Topic* topic = nullptr;
  edds::DataWriter* writer = nullptr;
  std::mutex mutex;
  Bytes bytes;  // guarded by the mutex
  std::atomic<std::uint32_t> matched{0};

  void close() {
    if (writer != nullptr) dds::delete_writer(*publisher, writer);
    if (publisher != nullptr) participant->participant->delete_publisher(publisher);
    if (topic != nullptr) participant->participant->delete_topic(topic);
  }
  void on_publication_matched(edds::DataWriter*, const edds::PublicationMatchedStatus& status) override {
    matched = static_cast<std::uint32_t>(status.current_count);
  }
};

PayloadWriter::PayloadWriter(dds::Participant& participant, const PayloadTopic& topic,
                             const diagnostics::EndpointQos& qos, int depth, InstanceOf instance_of)
    : impl_(std::make_unique<Impl>()) {
  impl_->participant = participant.impl();
  auto* of = impl_->participant->participant;
  if (topic.keyed && !instance_of) throw dds::DdsError("topic " + topic.name + ": its key is not known");
  if (of->find_type(topic.type).empty()) {
    const edds::TypeSupport type(topic.keyed ? new KeyedPayloadType(topic.type, std::move(instance_of))
                                             : new PayloadType(topic.type, false));
    type.register_type(of, topic.type);
  }
  impl_->topic = of->create_topic(topic.name, topic.type, edds::TOPIC_QOS_DEFAULT);
  edds::PublisherQos everywhere = edds::PUBLISHER_QOS_DEFAULT;
  auto partitions = qos.partitions;
  everywhere.partition().names(partitions);
  impl_->publisher = impl_->topic != nullptr ? of->create_publisher(everywhere) : nullptr;
  if (impl_->publisher != nullptr)
    impl_->writer = impl_->publisher->create_datawriter(impl_->topic, writer_qos(qos, depth), impl_.get());
  if (impl_->writer != nullptr) return;
  impl_->close();
  throw dds::DdsError("topic " + topic.name + ": Fast DDS refused a writer of " + topic.type);
}

PayloadWriter::~PayloadWriter() { impl_->close(); }

bool PayloadWriter::write(std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(impl_->mutex);
  impl_->bytes.assign(bytes.begin(), bytes.end());
  return impl_->writer->write(&impl_->bytes);
}

bool PayloadWriter::wait_until_received(core::Nanoseconds longest_ns) {
  return impl_->writer->wait_for_acknowledgments(duration_of(longest_ns)) == ReturnCode_t::RETCODE_OK;
}

std::uint32_t PayloadWriter::matched() const { return impl_->matched; }

}  // namespace phantom::observation
