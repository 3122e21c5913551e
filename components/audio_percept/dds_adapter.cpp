#include "components/audio_percept/dds_adapter.hpp"

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/status_reporter.hpp"
#include "components/audio_percept/dds_adapter_convert.hpp"

namespace phantom::audio_percept {
namespace {

/// A reader that writes its accepted samples to a snapshot.
template <class Message, class Converter, class Sample>
class Intake {
 public:
  template <class... Parts>
  Intake(dds::Participant& participant, const dds::TopicSpec<Message>& topic,
         core::Snapshot<Sample>& snapshot, const Parts&... converter_parts)
      : converter_(converter_parts...),
        reader_(participant, topic, [this, &snapshot](const Message& message, const dds::SampleInfo& info) {
          Sample sample;
          const bool accepted = converter_.accept(message, info.received_ns, sample);
          if (accepted) snapshot.write(sample);
          return accepted;
        }) {}
  const Converter& converter() const { return converter_; }

 private:
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
        alerts(participant, dds::kHitAlert, inbox.alerts, &percept.converter().followed()),
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
  messages::StatusReporter status;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::report(const core::Health& health) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  core::Health published = health;
  const auto add_rival = [&](const auto& intake, const char* topic) {
    if (intake.converter().has_second(now_ns)) published = dds::with_rival(std::move(published), topic);
  };
  add_rival(impl_->percept, "percept");
  add_rival(impl_->master, "master_state");
  add_rival(impl_->slave, "slave_state");
  add_rival(impl_->view, "view_pose");
  impl_->status.publish(published);
}

}  // namespace phantom::audio_percept
