#include "components/audio_percept/dds_adapter.hpp"

#include <atomic>

#include "common/dds/endpoint.hpp"
#include "common/dds/status_reporter.hpp"
#include "components/audio_percept/dds_adapter_convert.hpp"

namespace phantom::audio_percept {
namespace {

/// A reader whose accepted samples go into a snapshot.
template <class Message, class Converter, class Sample>
class Intake {
 public:
  Intake(dds::Participant& participant, const dds::TopicSpec<Message>& topic,
         core::Snapshot<Sample>& snapshot)
      : reader_(participant, topic, [this, &snapshot](const Message& message, const dds::SampleInfo& info) {
          Sample sample;
          if (converter_.accept(message, info.received_ns, sample)) {
            snapshot.write(sample);
          } else if (ready_) {
            reader_.count_refused();
          }
        }) {
    ready_ = true;
  }

 private:
  std::atomic<bool> ready_{false};  // samples may come while reader_ is still being made
  Converter converter_;
  dds::Reader<Message> reader_;
};

}  // namespace

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, Inbox& inbox)
      : participant("audio_percept", network),
        percept(participant, dds::kPercept, inbox.percept),
        master(participant, dds::kMasterState, inbox.master),
        slave(participant, dds::kSlaveState, inbox.slave),
        alerts(participant, dds::kHitAlert, inbox.alerts),
        command(participant, dds::kOperatorCommand, inbox.command),
        view(participant, dds::kViewPose, inbox.view),
        status(participant) {}

  dds::Participant participant;
  Intake<msg::Percept, PerceptConverter, PerceptSample> percept;
  Intake<msg::MasterState, LinkConverter, LinkSample> master;
  Intake<msg::SlaveState, LinkConverter, LinkSample> slave;
  Intake<msg::HitAlert, AlertConverter, AlertSample> alerts;
  Intake<msg::OperatorCommand, CommandConverter, CommandSample> command;
  Intake<msg::ViewPose, ViewConverter, ViewSample> view;
  dds::StatusReporter status;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::report(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::audio_percept
