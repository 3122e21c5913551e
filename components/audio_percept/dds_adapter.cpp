#include "components/audio_percept/dds_adapter.hpp"

#include <atomic>

#include "common/core/clock.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/status_reporter.hpp"
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
          if (converter_.accept(message, info.received_ns, sample)) {
            snapshot.write(sample);
          } else if (ready_) {
            reader_.count_refused();
          }
        }) {
    ready_ = true;
  }
  const Converter& converter() const { return converter_; }

 private:
  std::atomic<bool> ready_{false};  // samples can come before reader_ is fully constructed
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
  dds::StatusReporter status;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::report(const core::Health& health) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  core::Health told = health;
  const auto add_rival = [&](const auto& intake, const char* topic) {
    if (intake.converter().has_second(now_ns)) told = dds::with_rival(std::move(told), topic);
  };
  add_rival(impl_->percept, "percept");
  add_rival(impl_->master, "master_state");
  add_rival(impl_->slave, "slave_state");
  add_rival(impl_->view, "view_pose");
  impl_->status.publish(told);
}

}  // namespace phantom::audio_percept
