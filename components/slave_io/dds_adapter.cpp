#include "components/slave_io/dds_adapter.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>

#include "common/dds/endpoints/participant.hpp"
#include "common/messages/clock_report.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/object_subscriber.hpp"
#include "common/messages/operator_responder.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/request_log.hpp"
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
        master(participant, dds::kMasterState, {arm, {.other_model = messages::OtherModel::kMarked}},
               [this, &inbox](const messages::Received<messages::MasterState>& state) {
                 MasterSample sample(state, state.slave_echo, state.received_ns, participant.session());
                 sample.other_model = master.of_other_model();
                 inbox.master.write(sample);
               }),
        wrist(participant, dds::kWristWrench, {}, inbox.wrist),
        responder(participant, teleop::Side::kSlave, inbox.stops,
                  [this, &inbox](const messages::OperatorCommand& command) { return ask(command, inbox); }),
        payload_inbox(inbox.payload),
        places_inbox(inbox.places) {
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
  core::Status ask(const messages::OperatorCommand& command, Inbox& inbox) {
    const core::Status answer = carry_out(command, inbox);
    if (!messages::is_logged(request_rate, "requests")) return answer;
    if (answer) {
      spdlog::info("{} {:g}, asked for by {}", teleop::rule_of(command.kind).name, command.value,
                   command.issuer);
    } else {
      spdlog::warn("{} asked for what is refused: {}", command.issuer, answer.message());
    }
    return answer;
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
  messages::ClockReport clocks{"master_io"};
  messages::TopicSubscriber<msg::WristWrench> wrist;
  core::LogRate request_rate;  // of the responder's thread
  messages::OperatorResponder responder;
  core::Snapshot<robot::Payload>& payload_inbox;
  core::Snapshot<BoundedPlaces>& places_inbox;
  std::mutex workspace_mutex;  // guards what follows
  std::optional<PayloadRule> payload_rule;
  std::string payload_text;  // what is carried, or why it is refused
  std::vector<ObjectForceBound> bounded;
  BoundedPlaces stand;  // where these stand, unless an arm carries them
  std::vector<messages::CarriedObject> carried;
  std::optional<messages::ObjectSubscriber> objects;  // last: its callback uses the others

  void take(const messages::WorkspaceObject& object);
  void take(const std::vector<messages::CarriedObject>& now_carried);
  void pass_places();
};

/// Passes on where the objects with a bound are, with what arms carry.
void DdsAdapter::Impl::pass_places() {
  if (bounded.empty()) return;
  BoundedPlaces places = stand;
  places.carries = std::ranges::count(carried, payload_rule->name, &messages::CarriedObject::arm) > 0;
  for (std::size_t i = 0; i < bounded.size(); ++i)
    if (std::ranges::count(carried, bounded[i].object, &messages::CarriedObject::id) > 0)
      places.objects[i].place = BoundedPlaces::Place::kAnywhere;
  places_inbox.write(places);
}

void DdsAdapter::Impl::take(const messages::WorkspaceObject& object) {
  const auto found = std::ranges::find(bounded, object.id, &ObjectForceBound::object);
  if (found == bounded.end()) return;
  const auto index = static_cast<std::size_t>(found - bounded.begin());
  if (object.removed()) {
    stand.objects[index].place = BoundedPlaces::Place::kGone;
  } else if (object.name == found->name) {
    stand.stand_at(index, object.X_WO);
  } else {  // another one has its number
    stand.objects[index].place = BoundedPlaces::Place::kAnywhere;
  }
}

void DdsAdapter::Impl::take(const std::vector<messages::CarriedObject>& now_carried) {
  carried = now_carried;
  const auto payload = payload_of(carried, *payload_rule);
  std::string text;
  if (!payload) {
    text = payload.status().message();
  } else if (payload->mass_kg() > 0.0) {
    text = fmt::format("carries {:.3g} kg", payload->mass_kg());
    if (payload->displaced_m3() > 0.0)
      text += fmt::format(", displaces {:.3g} l of a fluid", 1e3 * payload->displaced_m3());
  }
  payload_inbox.write(payload ? *payload : robot::Payload());
  if (text == payload_text) return;
  payload_text = text;
  if (payload) {
    spdlog::info("{}", text.empty() ? "carries nothing of known weight" : text);
  } else {
    spdlog::warn("{}", text);
  }
}

/// Once the server has gone and until another is there, the arm carries what it carried, and objects are
/// where they were.
void DdsAdapter::follow_workspace(const PayloadRule& rule, const std::vector<ObjectForceBound>& bounded) {
  impl_->payload_rule = rule;
  impl_->bounded = bounded;
  impl_->objects.emplace(impl_->participant, [impl = impl_.get()](const auto& changes, const auto& carried) {
    const std::lock_guard lock(impl->workspace_mutex);
    for (const messages::WorkspaceObject& object : changes) impl->take(object);
    impl->take(carried);
    impl->pass_places();
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
  messages::add_difference(shown, impl_->master.model_difference());
  impl_->clocks.add_to(shown, impl_->master.clock_difference_s(), now_ns);
  {
    const std::lock_guard lock(impl_->workspace_mutex);
    const std::string& payload = impl_->payload_text;
    if (!payload.empty()) shown.message += (shown.message.empty() ? "" : "; ") + payload;
  }
  impl_->status.publish(shown);
}

}  // namespace phantom::slave_io
