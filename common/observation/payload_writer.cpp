#include "common/observation/payload_writer.hpp"

#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <mutex>

#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "common/observation/convert.hpp"
#include "common/observation/payload_type.hpp"
#include "fast_dds/endpoints.hpp"

namespace phantom::observation {
namespace {

namespace edds = eprosima::fastdds::dds;

edds::DataWriterQos writer_qos(const diagnostics::EndpointQos& given, int depth) {
  edds::DataWriterQos qos = edds::DATAWRITER_QOS_DEFAULT;
  set_policies(qos, given, depth);
  qos.lifespan().duration = duration_of(given.lifespan_ns);
  // The writer must assert it more often than the lease.
  if (given.lease_ns != diagnostics::kInfinite_ns)
    qos.liveliness().announcement_period = duration_of(given.lease_ns / 3);
  qos.publish_mode().kind = edds::SYNCHRONOUS_PUBLISH_MODE;
  fast_dds::set_heartbeats(qos, {0, 50'000'000}, {0, 0});
  dds::without_piggyback(qos);
  return qos;
}

}  // namespace

struct PayloadWriter::Impl : edds::DataWriterListener {
  std::shared_ptr<dds::Participant::Impl> participant;
  edds::Publisher* publisher = nullptr;
  edds::Topic* topic = nullptr;
  bool made_topic = false;  // false: a reader of this participant has it already
  edds::DataWriter* writer = nullptr;
  std::mutex mutex;
  SerializedSample sample;  // guarded by the mutex
  InstanceOf instance_of;
  std::atomic<std::uint32_t> matched{0};

  void close() {
    if (writer != nullptr) dds::delete_writer(*publisher, writer);
    if (publisher != nullptr) participant->participant->delete_publisher(publisher);
    if (made_topic && topic != nullptr) participant->participant->delete_topic(topic);
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
  if (topic.keyed) impl_->instance_of = std::move(instance_of);
  if (register_type(*of, topic)) {
    impl_->topic = dynamic_cast<edds::Topic*>(of->lookup_topicdescription(topic.name));
    impl_->made_topic = impl_->topic == nullptr;
    if (impl_->made_topic) impl_->topic = of->create_topic(topic.name, topic.type, edds::TOPIC_QOS_DEFAULT);
  }
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
  if (impl_->instance_of) {
    impl_->sample.instance = {};
    if (!impl_->instance_of(bytes, impl_->sample.instance)) return false;
  }
  impl_->sample.bytes.assign(bytes.begin(), bytes.end());
  return fast_dds::ok(impl_->writer->write(&impl_->sample));
}

bool PayloadWriter::wait_until_received(core::Nanoseconds longest_ns) {
  return fast_dds::ok(impl_->writer->wait_for_acknowledgments(duration_of(longest_ns)));
}

std::uint32_t PayloadWriter::matched() const { return impl_->matched; }

}  // namespace phantom::observation
