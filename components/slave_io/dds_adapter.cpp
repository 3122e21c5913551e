#include "components/slave_io/dds_adapter.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <mutex>

#include "common/dds/endpoints/participant.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/operator_responder.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::slave_io {
namespace {

constexpr core::Nanoseconds kGripperPeriod_ns =
    core::from_seconds(0.0095);  // 100 Hz, at any of the servo's rates

}  // namespace

core::Status CounterbalanceRequest::ask(bool on) {
  const State now = state_.load(std::memory_order_acquire);
  if (now == State::kNotYet)
    return core::Status::invalid_argument("counterbalance: slave_io is still starting; try again");
  if (now == State::kBalanced && on) {
    return core::Status::invalid_argument(
        "counterbalance: counterweights carry the arm's weight (plant.balanced); allowed: off");
  }
  if (now != State::kBalanced) state_.store(on ? State::kOn : State::kOff, std::memory_order_release);
  return core::Status::ok();
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
      : participant("slave_io", network),
        status(participant),
        slave(participant, dds::kSlaveState),
        master(participant, dds::kMasterState, arm,
               [this, &inbox](const messages::Received<messages::MasterState>& state) {
                 inbox.master.write({state, state.slave_echo, state.received_ns, participant.session()});
               }),
        wrist(participant, dds::kWristWrench, {}, inbox.wrist),
        responder(participant, teleop::Side::kSlave, inbox.stops,
                  [&inbox](const messages::OperatorCommand& command) { return ask(command, inbox); }),
        payload_inbox(inbox.payload) {
    if (inbox.gripper.has_gripper()) gripper.emplace(participant, dds::kGripperState);
  }

  static core::Status carry_out(const messages::OperatorCommand& command, Inbox& inbox) {
    switch (command.kind) {
      case teleop::CommandKind::kHome:
        return inbox.homing.ask();
      case teleop::CommandKind::kGripperWidth:
        return inbox.gripper.ask_width(command.value);
      case teleop::CommandKind::kGripperForce:
        return inbox.gripper.ask_force(command.value);
      case teleop::CommandKind::kCounterbalance:
        return inbox.counterbalance.ask(command.value == 1.0);
      case teleop::CommandKind::kTareForceSensor:
        return inbox.tare.ask();
      default:
        return core::Status::invalid_argument("this command is not for slave_io");
    }
  }
  static core::Status ask(const messages::OperatorCommand& command, Inbox& inbox) {
    const core::Status status = carry_out(command, inbox);
    if (status) {
      spdlog::info("{} {:g}, asked for by {}", teleop::rule_of(command.kind).name, command.value,
                   command.issuer);
    } else {
      spdlog::warn("{} asked for what is refused: {}", command.issuer, status.message());
    }
    return status;
  }

  // Slower than the state: nothing is closed in a loop over it.
  void publish_gripper(const SlaveReport& report, core::Nanoseconds now_ns) {
    if (!gripper || !report.gripper || now_ns < gripper_due_ns) return;
    gripper_due_ns = now_ns + kGripperPeriod_ns;
    gripper->publish(*report.gripper);
  }

  dds::Participant participant;
  messages::StatusReporter status;
  messages::Publisher<messages::SlaveState> slave;
  std::optional<messages::Publisher<messages::GripperState>> gripper;
  core::Nanoseconds gripper_due_ns = 0;
  messages::TopicSubscriber<msg::MasterState> master;
  messages::TopicSubscriber<msg::WristWrench> wrist;
  messages::OperatorResponder responder;
  core::Snapshot<robot::Payload>& payload_inbox;
  std::mutex payload_mutex;
  std::optional<PayloadRule> payload_rule;
  std::string payload_text;                                    // what is carried, or why it is refused
  std::optional<dds::GuidPrefix> workspace_source;             // the wva_server that is believed
  std::optional<dds::Reader<msg::WorkspaceVersion>> versions;  // last: its callbacks use the others

  void take(const messages::WorkspaceVersion& version);
};

/// Believes one wva_server at a time, as phantom_sensing does.
void DdsAdapter::Impl::take(const messages::WorkspaceVersion& version) {
  const auto payload = payload_of(version.carried, *payload_rule);
  std::string text;
  if (!payload) {
    text = payload.status().message();
  } else if (payload->mass_kg() > 0.0) {
    text = fmt::format("carries {:.3g} kg", payload->mass_kg());
  }
  payload_inbox.write(payload ? *payload : robot::Payload());
  if (text == payload_text) return;
  payload_text = text;
  if (payload) {
    spdlog::info("{}", text.empty() ? "carries nothing whose weight is known" : text);
  } else {
    spdlog::warn("{}", text);
  }
}

void DdsAdapter::follow_payload(const PayloadRule& rule) {
  Impl& impl = *impl_;
  impl.payload_rule = rule;
  impl.versions.emplace(
      impl.participant, dds::kWorkspaceVersion,
      [&impl](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
        const std::lock_guard lock(impl.payload_mutex);
        if (impl.workspace_source && *impl.workspace_source != info.writer) return false;
        const auto version = messages::from_idl(message);
        if (!version) return false;
        impl.workspace_source = info.writer;
        impl.take(*version);
        return true;
      },
      [&impl](const dds::GuidPrefix& server) {
        const std::lock_guard lock(impl.payload_mutex);
        if (impl.workspace_source == server)
          impl.workspace_source.reset();  // the arm carries what it carried
      });
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, arm, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const SlaveReport& report) {
  impl_->slave.publish(report);
  impl_->publish_gripper(report, core::monotonic_ns());
  impl_->responder.on_report(report.stop_requests, report.outputs.stop.id != 0);
}

void DdsAdapter::announce_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  impl_->responder.announce({.kind = teleop::CommandKind::kEmergencyStop, .issuer = issuer});
}

void DdsAdapter::publish_health(const core::Health& health) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  core::Health shown = health;
  if (impl_->wrist.source().has_rival(now_ns)) shown = dds::with_rival(shown, "wrist_wrench");
  if (impl_->master.source().has_rival(now_ns)) shown = dds::with_rival(shown, "master_state");
  {
    const std::lock_guard lock(impl_->payload_mutex);
    const std::string& payload = impl_->payload_text;
    if (!payload.empty()) shown.message += (shown.message.empty() ? "" : "; ") + payload;
  }
  impl_->status.publish(shown);
}

}  // namespace phantom::slave_io
