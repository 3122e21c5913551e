#include "components/audio_percept/dds_adapter.hpp"

#include "common/core/clock.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"
#include "components/audio_percept/topic_inputs.hpp"

namespace phantom::audio_percept {

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, Inbox& inbox)
      : participant("audio_percept", network),
        percept(participant, dds::kPercept, {}, inbox.percept),
        master(participant, dds::kMasterState, {}, inbox.master),
        slave(participant, dds::kSlaveState, {}, inbox.slave),
        alerts(
            participant, dds::kHitAlert, {},
            [this, &inbox](const messages::Received<messages::HitAlert>& alert) {
              inbox.alerts.write(alert_count.take(alert));
            },
            &percept.source()),
        // Several processes may write commands, so their sequence numbers do not order them.
        command(participant, dds::kOperatorCommand,
                [this, &inbox](const msg::OperatorCommand& message, const dds::SampleInfo& info) {
                  const auto sample = messages::from_idl(message);
                  if (!sample) return false;
                  take(*sample, info.received_ns, latest_command);
                  inbox.command.write(latest_command);
                  return true;
                }),
        view(participant, dds::kViewPose, {messages::ArmBounds(), {.hold_ns = kViewHold_ns}},
             [&inbox](const messages::Received<messages::ViewPose>& pose) {
               inbox.view.write(view_of(pose));
             }),
        status(participant) {}

  dds::Participant participant;
  AlertCount alert_count;
  CommandSample latest_command;
  messages::TopicSubscriber<msg::Percept> percept;
  messages::TopicSubscriber<msg::MasterState> master;
  messages::TopicSubscriber<msg::SlaveState> slave;
  messages::TopicSubscriber<msg::HitAlert> alerts;
  dds::Reader<msg::OperatorCommand> command;
  messages::TopicSubscriber<msg::ViewPose> view;
  messages::StatusReporter status;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::report(const core::Health& health) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  core::Health published = health;
  const auto add_second = [&](const auto& subscriber, const char* topic) {
    if (subscriber.source().has_second(now_ns)) published = dds::with_rival(std::move(published), topic);
  };
  add_second(impl_->percept, "percept");
  add_second(impl_->master, "master_state");
  add_second(impl_->slave, "slave_state");
  add_second(impl_->view, "view_pose");
  impl_->status.publish(published);
}

}  // namespace phantom::audio_percept
