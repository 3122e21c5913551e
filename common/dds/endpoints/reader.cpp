#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "common/dds/arbitration/reader_quota.hpp"
#include "common/dds/arbitration/writer_labels.hpp"
#include "common/dds/endpoints/dds_threads.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"
#include "fast_dds/type_support.hpp"

namespace phantom::dds {

namespace edds = eprosima::fastdds::dds;
namespace {

/// An endpoint's handle holds its GUID.
GuidPrefix writer_of(const fast_dds::rtps::InstanceHandle_t& handle) {
  return prefix_of(fast_dds::rtps::iHandle2GUID(handle));
}

}  // namespace

GuidPrefix prefix_of(const Participant& participant) {
  return prefix_of(participant.impl()->participant->guid());
}

Guid guid_of(const Participant& participant) { return octets_of(participant.impl()->participant->guid()); }

struct RawReader::Impl : edds::DataReaderListener {
  std::shared_ptr<Participant::Impl> participant;
  std::shared_ptr<EndpointCounters> counters;
  edds::TypeSupport type;
  void* sample = nullptr;  // reused for every take: DDS calls a reader's listener from one thread at a time
  OnSample on_sample;
  OnWriterGone on_writer_gone;
  std::unique_ptr<ReaderQuota> census;  // of a keyed topic
  edds::InstanceHandle_t labelled_writer;
  std::string model_label;  // its label
  edds::DataReader* reader = nullptr;

  ~Impl() override {
    if (sample != nullptr) type.delete_data(sample);
  }

  void on_data_available(edds::DataReader* from) override {
    take_receivers_place(participant->servo_priority);
    edds::SampleInfo info;
    while (fast_dds::ok(from->take_next_sample(sample, &info))) {
      if (!info.valid_data)
        continue;  // the system announces removals by samples (idl/workspace.idl), never by disposals
      SampleInfo given;
      given.received_ns = core::monotonic_ns();
      given.writer = writer_of(info.publication_handle);
      given.model_label = label_of(info.publication_handle);
      if (census) note_key(given.writer, info.instance_handle);
      counters->samples.fetch_add(1, std::memory_order_relaxed);
      counters->busy_since_ns.store(given.received_ns, std::memory_order_relaxed);
      if (!on_sample(sample, given)) counters->refused.fetch_add(1, std::memory_order_relaxed);
      counters->busy_since_ns.store(0, std::memory_order_relaxed);
    }
  }
  // Discovery knows a writer before its first sample. One without a label is looked up each time: it may have
  // been forgotten for others.
  std::string_view label_of(const edds::InstanceHandle_t& writer) {
    if (writer != labelled_writer || model_label.empty()) {
      labelled_writer = writer;
      model_label = participant->labels->of(octets_of(fast_dds::rtps::iHandle2GUID(writer)));
    }
    return model_label;
  }
  void note_key(const GuidPrefix& writer, const edds::InstanceHandle_t& handle) {
    KeyQuota::Key key;
    std::copy_n(static_cast<const std::uint8_t*>(handle.value), key.size(), key.begin());
    census->note(writer, key);
  }
  void on_subscription_matched(edds::DataReader*, const edds::SubscriptionMatchedStatus& status) override {
    counters->matched = static_cast<std::uint32_t>(status.current_count);
    if (status.current_count_change >= 0) return;
    const GuidPrefix gone = writer_of(status.last_publication_handle);
    if (census) census->forget(gone);
    if (on_writer_gone) on_writer_gone(gone);
  }
  void on_requested_deadline_missed(edds::DataReader*,
                                    const edds::RequestedDeadlineMissedStatus& status) override {
    counters->deadline_missed = static_cast<std::uint64_t>(status.total_count);
  }
  void on_liveliness_changed(edds::DataReader*, const edds::LivelinessChangedStatus& status) override {
    if (status.not_alive_count_change > 0) {
      counters->liveliness_lost.fetch_add(static_cast<std::uint64_t>(status.not_alive_count_change));
    }
  }
  void on_requested_incompatible_qos(edds::DataReader*,
                                     const edds::RequestedIncompatibleQosStatus& status) override {
    if (counters->incompatible_qos.exchange(static_cast<std::uint64_t>(status.total_count)) == 0) {
      report_incompatible(participant->component, *counters, static_cast<int>(status.last_policy_id));
    }
  }
};

RawReader::RawReader(Participant& participant, const TopicDescription& topic, OnSample on_sample,
                     OnWriterGone on_writer_gone)
    : impl_(std::make_unique<Impl>()) {
  impl_->participant = participant.impl();
  impl_->counters = participant.impl()->add_counters(topic, false);
  impl_->type = topic.make_type();
  impl_->sample = impl_->type.create_data();
  impl_->on_sample = std::move(on_sample);
  impl_->on_writer_gone = std::move(on_writer_gone);
  auto* subscriber = participant.impl()->subscriber;
  const edds::DataReaderQos qos = reader_qos(*subscriber, topic);
  if (fast_dds::is_keyed(*impl_->type)) {
    const auto instances = static_cast<std::size_t>(std::max(4, qos.resource_limits().max_instances));
    impl_->census = std::make_unique<ReaderQuota>(
        participant.component(), topic.name, ReaderQuota::most_keys(instances), participant.impl()->bans);
  }
  impl_->reader = subscriber->create_datareader(participant.impl()->topic(topic), qos, impl_.get());
  if (impl_->reader == nullptr)
    throw DdsError(std::string("topic ") + topic.name + ": Fast DDS refused the reader");
}

RawReader::~RawReader() {
  if (impl_ && impl_->reader != nullptr) impl_->participant->subscriber->delete_datareader(impl_->reader);
}

RawReader::RawReader(RawReader&&) noexcept = default;

void RawReader::count_refused() { impl_->counters->refused.fetch_add(1, std::memory_order_relaxed); }
Guid RawReader::guid() const { return octets_of(impl_->reader->guid()); }
std::uint32_t RawReader::matched() const { return impl_->counters->matched; }

}  // namespace phantom::dds
