#include "components/synthetic_viewer/dds_adapter.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/core/recent_map.hpp"
#include "common/dds/followed_source.hpp"
#include "common/dds/sole_source.hpp"
#include "common/dds/stamp.hpp"
#include "common/messages/object_sources.hpp"
#include "common/messages/operator_client.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/requester.hpp"
#include "common/messages/status_codec.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/messages/workspace_codec.hpp"
#include "components/synthetic_viewer/dds_adapter_names.hpp"
#include "components/synthetic_viewer/state.hpp"

namespace phantom::synthetic_viewer {
namespace {

// The time in which a stop is confirmed, plus two network delays.
constexpr double kStopAnswer_s = core::seconds(core::kStopConfirmedWithin_ns) + 0.05;
constexpr double kAnswer_s = 0.5;
constexpr core::Nanoseconds kSkinHold_ns = core::kNsPerSecond;  // skin_percept comes at 20 Hz

bool is_for_views(CommandKind kind) {
  return kind == CommandKind::kViewHold || kind == CommandKind::kViewNode;
}

/// Returns whether only one such component may run; viewers, recorders and audio components may be several.
bool may_run_once(const std::string& component) {
  return component == "master_io" || component == "slave_io" || component == "phantom_sensing" ||
         component == "wva_server";
}

}  // namespace

SkinSample skin_of(const messages::SkinPercept& percept, core::Nanoseconds received_ns) {
  SkinSample sample;
  sample.received_ns = received_ns;
  sample.valid = percept.valid && percept.greatest_mu_Pa_s_per_m > 0;
  sample.patch_m = percept.patch_m;
  if (!sample.valid) return sample;
  for (const messages::SkinPatch& patch : percept.felt) {
    const double share = static_cast<double>(patch.mu_Pa_s_per_m) / percept.greatest_mu_Pa_s_per_m;
    sample.felt.push_back({patch.link, patch.middle_m, static_cast<float>(std::min(1.0, share))});
  }
  return sample;
}

struct DdsAdapter::Impl {
  Inbox& inbox;
  messages::ArmBounds arm_bounds;
  dds::Participant participant;
  messages::OperatorClient operator_client;
  std::mutex workspace_mutex;
  messages::Requester<messages::WorkspaceCommand, messages::WorkspaceReply> workspace_requester;
  std::optional<messages::Publisher<messages::ViewPose>> view_poses;
  std::optional<messages::Publisher<messages::ViewPicture>> pictures;
  std::array<Broadcast<std::string>::Content, kViews.size()> published;  // the picture of each view
  bool follows_pictures = false;
  core::Nanoseconds pictures_due_ns = 0;
  messages::StatusReporter status;

  // Each is used on the thread of its reader's callbacks.
  dds::SoleSource arm_source, master_source, percept_source, gripper_source, skin_source{kSkinHold_ns};
  dds::FollowedSource phantom;  // the process that percept is taken from
  dds::SequenceGuard hit_order;
  std::uint64_t arm_arrived = 0;
  core::Snapshot<ArmSample> arm_for_hits;             // read only by the callback thread of hit alerts
  core::Snapshot<PerceptSample> percept_for_hits;     // likewise
  ArmSample newest_arm;                               // used on the callback thread of hit alerts
  PerceptSample newest_percept;                       // likewise
  ComponentNames names{ViewerState::kMaxComponents};  // ViewerState forgets the same ones, and counts them
  std::mutex servers_mutex;
  messages::ObjectSources servers;  // guarded by servers_mutex

  // Declared last, so that their callbacks end before the members that they use are destroyed.
  std::optional<dds::Reader<msg::SlaveState>> arm;
  std::optional<dds::Reader<msg::MasterState>> master;
  std::optional<dds::Reader<msg::GripperState>> gripper;
  std::optional<dds::Reader<msg::Percept>> percept;
  std::optional<dds::Reader<msg::HitAlert>> hits;
  std::optional<dds::Reader<msg::SkinPercept>> skin;
  std::optional<dds::Reader<msg::WorkspaceVersion>> versions;
  std::optional<dds::Reader<msg::WorkspaceObject>> objects;
  std::optional<dds::Reader<msg::MeshChunk>> chunks;
  std::optional<dds::Reader<msg::ComponentStatus>> components;
  std::optional<dds::Reader<msg::OperatorCommand>> view_commands;

  Impl(const core::NetworkOptions& network, const messages::ArmBounds& bounds, Inbox& viewer_inbox)
      : inbox(viewer_inbox),
        arm_bounds(bounds),
        participant("synthetic_viewer", network),
        operator_client(
            participant,
            [this](const std::optional<core::CommandAnswers>& stop) { inbox.stops.take_request(stop); }),
        workspace_requester(participant, dds::kWorkspaceCommand, dds::kWorkspaceReply),
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
  Command completed(Command command) const;

  /// Writes a state to a snapshot if it is valid, newer than the last, and of the followed process.
  template <class T, class Sample>
  auto to_snapshot(const dds::TopicSpec<T>& topic, dds::SoleSource& source,
                   core::Snapshot<Sample>& snapshot) {
    return [this, &source, &topic, &snapshot](const T& message, const dds::SampleInfo& info) {
      const auto sound = messages::from_idl(message, arm_bounds);
      if (!sound || !take(source, message.stamp(), topic.name, info.received_ns)) return false;
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
      return true;
    };
  }
  void open_states();
  void open_events();
  void open_workspace();
  void put(const std::vector<messages::WorkspaceObject>& changes) {
    for (const messages::WorkspaceObject& object : changes) inbox.put(object);
  }
};

void DdsAdapter::Impl::open_states() {
  arm.emplace(participant, dds::kSlaveState, to_snapshot(dds::kSlaveState, arm_source, inbox.arm));
  master.emplace(participant, dds::kMasterState, to_snapshot(dds::kMasterState, master_source, inbox.master));
  gripper.emplace(participant, dds::kGripperState,
                  to_snapshot(dds::kGripperState, gripper_source, inbox.gripper));
  percept.emplace(participant, dds::kPercept, to_snapshot(dds::kPercept, percept_source, inbox.percept));
}

void DdsAdapter::Impl::open_events() {
  hits.emplace(participant, dds::kHitAlert,
               [this](const msg::HitAlert& message, const dds::SampleInfo& info) {
                 const auto sound = messages::from_idl(message, arm_bounds);
                 const bool foreign = phantom.is_rival(message.stamp(), info.received_ns);
                 if (!sound || foreign || !hit_order.accept(message.stamp())) return false;
                 HitSample hit(*sound, info.received_ns);
                 arm_for_hits.read(newest_arm);
                 percept_for_hits.read(newest_percept);
                 hit.arm = newest_arm;
                 hit.percept = newest_percept;
                 inbox.put(std::move(hit));
                 return true;
               });
  skin.emplace(participant, dds::kSkinPercept,
               [this](const msg::SkinPercept& message, const dds::SampleInfo& info) {
                 const auto sound = messages::from_idl(message, arm_bounds);
                 if (!sound || !take(skin_source, message.stamp(), "skin_percept", info.received_ns))
                   return false;
                 inbox.put(skin_of(*sound, info.received_ns));
                 return true;
               });
  components.emplace(participant, dds::kComponentStatus,
                     [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                       const auto component = messages::from_idl(message);
                       if (!component) return false;
                       const std::string key = component->component + "@" + component->host;
                       if (!names.accept(key, message.stamp(), info.received_ns)) return false;
                       if (names.has_second(key, info.received_ns) && may_run_once(component->component))
                         inbox.stops.take_second("component_status as " + key, info.received_ns);
                       return inbox.put(ComponentSample(*component, info.received_ns));
                     });
  view_commands.emplace(participant, dds::kOperatorCommand,
                        [this](const msg::OperatorCommand& message, const dds::SampleInfo&) {
                          // Several processes may write commands, so their sequence numbers do not order
                          // them.
                          const auto command = messages::from_idl(message);
                          if (!command) return false;
                          if (is_for_views(command->kind)) inbox.put(*command);
                          return true;
                        });
}

void DdsAdapter::Impl::open_workspace() {
  objects.emplace(participant, dds::kWorkspaceObject,
                  [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
                    const auto object = messages::from_idl(message);
                    if (!object) return false;
                    const std::lock_guard lock(servers_mutex);
                    const auto taken = servers.take(info.writer, *object);
                    put(taken.changes);
                    return taken.accepted;
                  });
  versions.emplace(
      participant, dds::kWorkspaceVersion,
      [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
        const auto version = messages::from_idl(message);
        if (!version) return false;
        const std::lock_guard lock(servers_mutex);
        const auto taken = servers.commit(info.writer);
        put(taken.changes);
        if (taken.accepted)
          inbox.put(WorkspaceSample{version->description.version, version->description.grid.voxel_size_m,
                                    version->carried});
        return taken.accepted;
      },
      [this](const dds::GuidPrefix& server) {
        const std::lock_guard lock(servers_mutex);
        put(servers.gone(server));
      });
  chunks.emplace(participant, dds::kMeshChunk, [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
    auto chunk = messages::from_idl(message);
    if (!chunk) return false;
    return inbox.put(std::move(*chunk));
  });
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, arm, inbox)) {}

DdsAdapter::~DdsAdapter() = default;

Command DdsAdapter::Impl::completed(Command command) const {
  command.issuer = "operator's page";
  if (command.kind == CommandKind::kReset) {
    command.master_stop = inbox.stops.stop_of(core::Side::kMaster);
    command.slave_stop = inbox.stops.stop_of(core::Side::kSlave);
  }
  return command;
}

CommandOutcome DdsAdapter::ask(const Command& command) {
  using Kind = CommandOutcome::Kind;
  const bool stop = command.kind == CommandKind::kEmergencyStop;
  const core::CommandAnswers answers =
      impl_->operator_client.ask(impl_->completed(command), stop ? kStopAnswer_s : kAnswer_s);
  return {answers.done()      ? Kind::kDone
          : answers.refused() ? Kind::kRefused
                              : Kind::kUnanswered,
          stop ? core::stop_words(answers) : core::command_words(answers)};
}

CommandOutcome DdsAdapter::carry(const CarryRequest& request) {
  using Kind = CommandOutcome::Kind;
  messages::WorkspaceCommand command;
  command.requester = messages::requester_name("operator's page");
  command.operation =
      request.attach ? messages::WorkspaceOperation::kAttach : messages::WorkspaceOperation::kRelease;
  command.object = request.object;
  CommandOutcome outcome{Kind::kUnanswered, "NOT CONFIRMED by wva_server"};
  const std::lock_guard lock(impl_->workspace_mutex);
  impl_->workspace_requester.ask(command, kAnswer_s, [&](const messages::WorkspaceReply& reply) {
    const bool accepted = reply.outcome == messages::WorkspaceOutcome::kAccepted;
    if (accepted) outcome.message = "wva_server is about it: the page shows what it becomes";
    if (!accepted)
      outcome = {reply.outcome == messages::WorkspaceOutcome::kDone ? Kind::kDone : Kind::kRefused,
                 reply.message};
    return !accepted;
  });
  return outcome;
}

void DdsAdapter::send(const Command& command) {
  impl_->operator_client.send(impl_->completed(command), kAnswer_s);
}

void DdsAdapter::publish(const ViewPoseSample& view) {
  // Created with the first pose: an onlooker's viewer publishes none, and must not be missed by readers of
  // the topic.
  if (!impl_->view_poses) impl_->view_poses.emplace(impl_->participant, dds::kViewPose);
  impl_->view_poses->publish(view);
}

void DdsAdapter::publish_pictures(PageContent& page, double rate_Hz) {
  const core::Nanoseconds now_ns = core::monotonic_ns();
  if (rate_Hz <= 0.0 || now_ns < impl_->pictures_due_ns) return;
  impl_->pictures_due_ns = now_ns + core::from_seconds(0.95 / rate_Hz);  // the caller's period is not exact
  if (!impl_->pictures) impl_->pictures.emplace(impl_->participant, dds::kViewPicture);
  const bool wanted = impl_->pictures->matched() > 0;
  if (wanted != impl_->follows_pictures)
    for (ViewOutput& view : page.views) view.jpeg.followers.fetch_add(wanted ? 1 : -1);
  impl_->follows_pictures = wanted;
  for (std::size_t view = 0; wanted && view < page.views.size(); ++view) {
    const auto newest = page.views[view].jpeg.newest();
    if (!newest || newest == impl_->published[view] || newest->size() > messages::kMostPictureBytes) continue;
    impl_->published[view] = newest;
    impl_->pictures->publish({.stamp = {},
                              .view = static_cast<messages::PictureView>(view),
                              .jpeg = {newest->begin(), newest->end()}});
  }
}

void DdsAdapter::publish(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::synthetic_viewer
