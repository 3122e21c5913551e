#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/participant_impl.hpp"
#include "common/dds/endpoints/qos.hpp"

namespace phantom::dds {

namespace edds = eprosima::fastdds::dds;

struct RawWriter::Impl : edds::DataWriterListener {
  std::shared_ptr<Participant::Impl> participant;
  std::shared_ptr<EndpointCounters> counters;
  edds::DataWriter* writer = nullptr;

  void on_publication_matched(edds::DataWriter*, const edds::PublicationMatchedStatus& status) override {
    counters->matched = static_cast<std::uint32_t>(status.current_count);
  }
  void on_offered_deadline_missed(edds::DataWriter*,
                                  const edds::OfferedDeadlineMissedStatus& status) override {
    counters->deadline_missed = static_cast<std::uint64_t>(status.total_count);
  }
  void on_liveliness_lost(edds::DataWriter*, const edds::LivelinessLostStatus& status) override {
    counters->liveliness_lost = static_cast<std::uint64_t>(status.total_count);
  }
  void on_offered_incompatible_qos(edds::DataWriter*,
                                   const edds::OfferedIncompatibleQosStatus& status) override {
    if (counters->incompatible_qos.exchange(static_cast<std::uint64_t>(status.total_count)) == 0) {
      report_incompatible(participant->component, *counters, static_cast<int>(status.last_policy_id));
    }
  }
};

RawWriter::RawWriter(Participant& participant, const TopicDescription& topic)
    : impl_(std::make_unique<Impl>()) {
  impl_->participant = participant.impl();
  impl_->counters = participant.impl()->add_counters(topic, true);
  auto* publisher = participant.impl()->publisher;
  edds::DataWriterQos qos = writer_qos(*publisher, topic);
  const std::string& label = participant.impl()->model_label;
  if (!topic.foreign) qos.user_data().assign(label.begin(), label.end());
  impl_->writer = publisher->create_datawriter(participant.impl()->topic(topic), qos, impl_.get());
  if (impl_->writer == nullptr)
    throw DdsError(std::string("topic ") + topic.name + ": Fast DDS refused the writer");
}

RawWriter::~RawWriter() {
  if (impl_ && impl_->writer != nullptr) delete_writer(*impl_->participant->publisher, impl_->writer);
}

RawWriter::RawWriter(RawWriter&&) noexcept = default;

bool RawWriter::write(void* sample) {
  const bool written = fast_dds::ok(impl_->writer->write(sample));
  if (written) impl_->counters->samples.fetch_add(1, std::memory_order_relaxed);
  return written;
}

Guid RawWriter::guid() const { return octets_of(impl_->writer->guid()); }
std::uint32_t RawWriter::matched() const { return impl_->counters->matched; }
void RawWriter::assert_liveliness() { impl_->writer->assert_liveliness(); }

}  // namespace phantom::dds
