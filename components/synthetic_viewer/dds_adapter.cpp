#include "components/synthetic_viewer/dds_adapter.hpp"

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/dds/followed_source.hpp"
#include "common/dds/operator_client.hpp"
#include "common/dds/sole_source.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/messages/workspace_codec.hpp"

namespace phantom::synthetic_viewer {
namespace {

// The time in which a stop is confirmed, plus two network delays.
constexpr double kStopAnswer_s = core::seconds(core::kStopConfirmedWithin_ns) + 0.05;
constexpr double kAnswer_s = 0.5;
constexpr core::Nanoseconds kStatusHold_ns = 3 * core::kNsPerSecond / 2;  // component_status comes at 2 Hz
constexpr core::Nanoseconds kSkinHold_ns = core::kNsPerSecond;            // skin_percept comes at 20 Hz

/// A reader that its own callback can use: samples can come before its constructor has returned.
template <class T>
struct Input {
  std::atomic<dds::Reader<T>*> ready{nullptr};
  std::unique_ptr<dds::Reader<T>> reader;

  void open(dds::Participant& participant, const dds::TopicSpec<T>& topic,
            typename dds::Reader<T>::OnSample on_sample) {
    reader = std::make_unique<dds::Reader<T>>(participant, topic, std::move(on_sample));
    ready = reader.get();
  }
  void refuse() {
    if (dds::Reader<T>* self = ready.load()) self->count_refused();
  }
};

bool is_for_views(CommandKind kind) {
  return kind == CommandKind::kViewHold || kind == CommandKind::kViewNode;
}

/// Returns whether only one such component may run; viewers, recorders and audio components may be several.
bool may_run_once(const std::string& component) {
  return component == "master_io" || component == "slave_io" || component == "phantom_sensing" ||
         component == "wva_server";
}

}  // namespace

struct DdsAdapter::Impl {
  Inbox& inbox;
  messages::ArmBounds arm_bounds;
  dds::Participant participant;
  dds::OperatorClient operator_client;
  std::optional<dds::Writer<msg::ViewPose>> view_poses;
  dds::Stamper view_stamper;
  dds::StatusReporter status;

  // Each is used on the thread of its reader's callbacks.
  dds::SoleSource arm_source, master_source, percept_source, skin_source{kSkinHold_ns};
  dds::FollowedSource phantom;  // the process that percept is taken from
  dds::SequenceGuard hit_order;
  std::uint64_t arm_arrived = 0;
  core::Snapshot<ArmSample> arm_for_hits;                   // read only by the callback thread of hit alerts
  core::Snapshot<PerceptSample> percept_for_hits;           // likewise
  ArmSample newest_arm;                                     // used on the callback thread of hit alerts
  PerceptSample newest_percept;                             // likewise
  std::map<std::string, dds::SoleSource> component_source;  // by name and host

  // Declared last, so that their callbacks end before the members that they use are destroyed.
  Input<msg::SlaveState> arm;
  Input<msg::MasterState> master;
  Input<msg::Percept> percept;
  Input<msg::HitAlert> hits;
  Input<msg::SkinPercept> skin;
  Input<msg::WorkspaceVersion> versions;
  Input<msg::WorkspaceObject> objects;
  Input<msg::MeshChunk> chunks;
  Input<msg::ComponentStatus> components;
  Input<msg::OperatorCommand> view_commands;

  Impl(const core::NetworkOptions& network, const messages::ArmBounds& bounds, Inbox& viewer_inbox)
      : inbox(viewer_inbox),
        arm_bounds(bounds),
        participant("synthetic_viewer", network),
        operator_client(
            participant,
            [this](const std::optional<core::CommandAnswers>& stop) { inbox.stops.take_request(stop); }),
        view_stamper(participant),
        status(participant) {
    open_states();
    open_events();
    open_workspace();
  }

  /// Returns whether the sample is newer than the last one of the followed process. Reports a second process.
  bool take(dds::SoleSource& source, const msg::Stamp& stamp, const std::string& topic,
            core::Nanoseconds received_ns) {
    const bool accepted = source.accept(stamp, received_ns);
    if (source.has_second(received_ns)) inbox.stops.take_second(topic, received_ns);
    return accepted;
  }
  void take_side(core::Side side, const auto& sample) {
    inbox.stops.take_state(side, sample.state, sample.stop.cause, sample.stop.id, sample.received_ns);
    operator_client.take_state(side, sample.stamp.session,
                               sample.state == LinkState::kStopped ? sample.stop.id : 0, sample.received_ns);
  }
  msg::OperatorCommand message_of(const Command& command) const;

  /// Writes a state to a snapshot if it is valid, newer than the last, and of the followed process.
  template <class T, class Sample>
  auto to_snapshot(Input<T>& input, dds::SoleSource& source, const char* topic,
                   core::Snapshot<Sample>& snapshot) {
    return [this, &input, &source, topic, &snapshot](const T& message, const dds::SampleInfo& info) {
      const auto sound = messages::from_idl(message, arm_bounds);
      if (!sound || !take(source, message.stamp(), topic, info.received_ns)) return input.refuse();
      Sample sample(*sound, info.received_ns);
      if constexpr (std::is_same_v<Sample, ArmSample>) {
        sample.arrived = ++arm_arrived;
        sample.lost = source.lost();
        arm_for_hits.write(sample);
        take_side(core::Side::kSlave, sample);
      } else if constexpr (std::is_same_v<Sample, MasterSample>) {
        take_side(core::Side::kMaster, sample);
      } else if constexpr (std::is_same_v<Sample, PerceptSample>) {
        phantom.heard(message.stamp(), info.received_ns);
        percept_for_hits.write(sample);
      }
      snapshot.write(sample);
    };
  }
  void open_states();
  void open_events();
  void open_workspace();
};

void DdsAdapter::Impl::open_states() {
  arm.open(participant, dds::kSlaveState, to_snapshot(arm, arm_source, "slave_state", inbox.arm));
  master.open(participant, dds::kMasterState,
              to_snapshot(master, master_source, "master_state", inbox.master));
  percept.open(participant, dds::kPercept, to_snapshot(percept, percept_source, "percept", inbox.percept));
}

void DdsAdapter::Impl::open_events() {
  hits.open(participant, dds::kHitAlert, [this](const msg::HitAlert& message, const dds::SampleInfo& info) {
    const auto sound = messages::from_idl(message, arm_bounds);
    const bool foreign = phantom.is_rival(message.stamp(), info.received_ns);
    if (!sound || foreign || !hit_order.accept(message.stamp())) return hits.refuse();
    HitSample hit(*sound, info.received_ns);
    arm_for_hits.read(newest_arm);
    percept_for_hits.read(newest_percept);
    hit.arm = newest_arm;
    hit.percept = newest_percept;
    inbox.put(std::move(hit));
  });
  skin.open(participant, dds::kSkinPercept,
            [this](const msg::SkinPercept& message, const dds::SampleInfo& info) {
              const auto sound = messages::from_idl(message, arm_bounds);
              if (!sound || !take(skin_source, message.stamp(), "skin_percept", info.received_ns))
                return skin.refuse();
              inbox.put(skin_of(*sound, info.received_ns));
            });
  components.open(participant, dds::kComponentStatus,
                  [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                    auto component = convert(message);
                    if (!component) return components.refuse();
                    const std::string key = component->name + "@" + component->host;
                    auto& source = component_source.try_emplace(key, kStatusHold_ns).first->second;
                    if (!source.accept(message.stamp(), info.received_ns)) return components.refuse();
                    if (source.has_second(info.received_ns) && may_run_once(component->name))
                      inbox.stops.take_second("component_status as " + key, info.received_ns);
                    component->received_ns = info.received_ns;
                    inbox.put(std::move(*component));
                  });
  view_commands.open(participant, dds::kOperatorCommand,
                     [this](const msg::OperatorCommand& message, const dds::SampleInfo&) {
                       // Several processes may write commands, so their sequence numbers do not order them.
                       const auto command = convert(message);
                       if (!command) return view_commands.refuse();
                       if (is_for_views(command->kind)) inbox.put(*command);
                     });
}

void DdsAdapter::Impl::open_workspace() {
  objects.open(participant, dds::kWorkspaceObject,
               [this](const msg::WorkspaceObject& message, const dds::SampleInfo&) {
                 const auto object = messages::from_idl(message);
                 if (!object) return objects.refuse();
                 inbox.put(object->removed() ? Event(ObjectGone{object->id}) : Event(*object));
               });
  versions.open(participant, dds::kWorkspaceVersion,
                [this](const msg::WorkspaceVersion& message, const dds::SampleInfo&) {
                  const auto version = convert(message);
                  if (!version) return versions.refuse();
                  inbox.put(*version);
                });
  chunks.open(participant, dds::kMeshChunk, [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
    auto chunk = convert(message);
    if (!chunk) return chunks.refuse();
    inbox.put(std::move(*chunk));
  });
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, arm, inbox)) {}

DdsAdapter::~DdsAdapter() = default;

msg::OperatorCommand DdsAdapter::Impl::message_of(const Command& command) const {
  msg::OperatorCommand message;
  message.kind(static_cast<msg::CommandKind>(command.kind));
  message.value(command.value);
  message.joint(-1);  // gains apply to all joints
  message.issuer("operator's page");
  if (command.kind == CommandKind::kReset) {
    message.master_stop(inbox.stops.stop_of(core::Side::kMaster));
    message.slave_stop(inbox.stops.stop_of(core::Side::kSlave));
  }
  return message;
}

CommandOutcome DdsAdapter::ask(const Command& command) {
  using Kind = CommandOutcome::Kind;
  const bool stop = command.kind == CommandKind::kEmergencyStop;
  const core::CommandAnswers answers =
      impl_->operator_client.ask(impl_->message_of(command), stop ? kStopAnswer_s : kAnswer_s);
  return {answers.done()      ? Kind::kDone
          : answers.refused() ? Kind::kRefused
                              : Kind::kUnanswered,
          stop ? core::stop_words(answers) : core::command_words(answers)};
}

void DdsAdapter::send(const Command& command) {
  impl_->operator_client.send(impl_->message_of(command), kAnswer_s);
}

void DdsAdapter::publish(const ViewPoseSample& view) {
  // Created with the first pose: an onlooker's viewer publishes none, and must not be missed by readers of
  // the topic.
  if (!impl_->view_poses) impl_->view_poses.emplace(impl_->participant, dds::kViewPose);
  msg::ViewPose message = messages::to_idl(view);
  message.stamp(impl_->view_stamper.next());
  impl_->view_poses->write(message);
}

void DdsAdapter::publish(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::synthetic_viewer
