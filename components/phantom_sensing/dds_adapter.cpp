#include "components/phantom_sensing/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "common/dds/admission/refusal_log.hpp"
#include "common/geometry/pose.hpp"
#include "common/messages/clock_report.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/command_service.hpp"
#include "common/messages/object_sources.hpp"
#include "common/messages/pose_findings.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/request_log.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"

namespace phantom::phantom_sensing {
namespace {

/// DDS drops a killed server only 5 s after its last announcement. A second server is therefore reported only
/// if both are present for longer than that.
constexpr core::Nanoseconds kSecondServerAfter_ns = 7 * core::kNsPerSecond;

/// Four of its periods.
constexpr core::Nanoseconds kSpaceViewHold_ns = 2 * core::kNsPerSecond;

messages::ArmBounds bounds_of(const PhantomModel& model) {
  return messages::bounds_of(model.arm, model.identity);
}
// Another arm's files are its own cell's.
messages::ArmBounds bounds_of(const OtherArm& other) {
  messages::ArmBounds bounds = messages::bounds_of(other.arm());
  bounds.identity.reset();
  return bounds;
}

messages::SensingReply reply_to(const messages::SensingCommand& command, const Answer& answer) {
  return {.requester = command.requester,
          .request = command.request,
          .done = answer.done,
          .message = answer.message};
}

}  // namespace

struct DdsAdapter::Impl {
  struct WorkspaceReaders {
    WorkspaceReaders(Impl& owner, WorkspaceSubscriber& workspace);
    dds::Reader<msg::MeshChunk> mesh;  // before the version that needs it
    dds::Reader<msg::WorkspaceVersion> version;
    dds::Reader<msg::WorkspaceBrick> brick;
    dds::Reader<msg::WorkspaceObject> object;
  };
  /// The objects of the arm's workspace, for a share that is sensed in one of its own.
  struct ObjectReaders {
    explicit ObjectReaders(Impl& owner);
    dds::Reader<msg::WorkspaceVersion> version;
    dds::Reader<msg::WorkspaceObject> object;
  };
  /// What the process of a share of the skin publishes.
  struct ShareReaders {
    ShareReaders(Impl& owner, SensingLoop& loop, std::size_t share);
    messages::TopicSubscriber<msg::DragField> drag_field;
    messages::TopicSubscriber<msg::Percept> percept;
  };
  struct Readers {
    Readers(Impl& owner, SensingLoop& loop, WorkspaceSubscriber& keeper);
    messages::TopicSubscriber<msg::SlaveState> slave;
    std::optional<messages::TopicSubscriber<msg::GripperState>> gripper;  // of an arm with fingers
    std::unique_ptr<WorkspaceReaders> workspace;
    dds::Reader<msg::PoseFinding> finding;
    messages::TopicSubscriber<msg::SpaceView> seen;
    std::optional<ObjectReaders> of_arm;
    std::vector<std::unique_ptr<ShareReaders>> shares;
    std::vector<std::unique_ptr<messages::TopicSubscriber<msg::SlaveState>>> others;  // other arms' states
  };

  Impl(const core::NetworkOptions& network, const PhantomModel& phantom,
       const std::vector<std::string>& partitions, std::span<const OtherArm> others)
      : model(phantom),
        other_arms(others),
        participant("phantom_sensing", network),
        apart(participant_apart(network, phantom)),
        shares(participants_of(network, phantom, partitions)),
        beside(participants_beside(network, others)),
        of_workspace(apart ? *apart : participant),
        results(phantom.own_share ? *shares.front() : participant),
        status(participant, status_name(phantom)),
        drag_field(results, dds::kDragField),
        percept(results, dds::kPercept),
        hit_alert(results, dds::kHitAlert),
        model_doubt(results, dds::kModelDoubt),
        interest_points(results, dds::kInterestPoints),
        skin_percept(results, dds::kSkinPercept),
        commands(results, dds::kSensingCommand, dds::kSensingReply,
                 {.refused = [](const messages::SensingCommand& command, const std::string& why) {
                   return reply_to(command, {false, why});
                 }}) {
    for (const auto* participants : {&shares, &beside})
      for (const auto& joined : *participants) status.count_refusals_of(*joined);
    if (apart) status.count_refusals_of(*apart);
  }

  /// Returns the topic that two processes write of those that only one may write, or null.
  const char* rival() {
    const std::lock_guard lock(readers_mutex);
    const core::Nanoseconds now_ns = core::monotonic_ns();
    if (!readers) return nullptr;
    if (readers->slave.source().has_rival(now_ns)) return "slave_state";
    if (readers->seen.source().has_rival(now_ns)) return "space_view";
    for (const auto& share : readers->shares)
      if (share->drag_field.source().has_rival(now_ns)) return "drag_field of a share of the skin";
    for (const auto& other : readers->others)
      if (other->source().has_rival(now_ns)) return "slave_state of another arm";
    return readers->gripper && readers->gripper->source().has_rival(now_ns) ? "gripper_state" : nullptr;
  }

  /// Takes what a camera has found of an object. Returns whether it is valid.
  bool take(const msg::PoseFinding& message);
  bool second_server(core::Nanoseconds now_ns);
  void suspend(const workspace::SourceId& source);
  void resume();

  using Participants = std::vector<std::unique_ptr<dds::Participant>>;
  /// The process of a share has a name of its own in component_status.
  static std::string status_name(const PhantomModel& model) {
    return model.own_share ? "phantom_sensing_" + model.shares[*model.own_share].name : "phantom_sensing";
  }
  static Participants participants_of(const core::NetworkOptions& network, const PhantomModel& model,
                                      const std::vector<std::string>& partitions);

  static std::unique_ptr<dds::Participant> participant_apart(const core::NetworkOptions& network,
                                                             const PhantomModel& model);
  static Participants participants_beside(const core::NetworkOptions& network,
                                          std::span<const OtherArm> others);

  const PhantomModel& model;
  const std::span<const OtherArm> other_arms;
  dds::Participant participant;
  const std::unique_ptr<dds::Participant> apart;  // in the partition of the own share's workspace
  const Participants shares;  // in the partitions of the shares: of all, or of the one that is sensed here
  const Participants beside;  // in the partitions of the other arms
  dds::Participant& of_workspace;  // reads what wva_server sends
  dds::Participant& results;       // publishes what is sensed
  messages::StatusReporter status;
  messages::Publisher<messages::DragField> drag_field;
  messages::Publisher<messages::Percept> percept;
  messages::Publisher<messages::HitAlert> hit_alert;
  messages::Publisher<messages::ModelDoubt> model_doubt;
  messages::Publisher<messages::InterestPoints> interest_points;
  messages::Publisher<messages::SkinPercept> skin_percept;
  mutable std::mutex objects_mutex;
  messages::ObjectSources objects;         // guarded by objects_mutex
  messages::ObjectSources objects_of_arm;  // likewise
  messages::PoseFindings findings;         // likewise
  dds::RefusalLog workspace_refusals{"workspace_brick, workspace_version"};
  std::mutex readers_mutex;  // shared by stop_reading() and the keeper's thread
  std::unique_ptr<Readers> readers;
  WorkspaceSubscriber* keeper = nullptr;     // set while there are readers; guarded by readers_mutex
  core::Nanoseconds contested_since_ns = 0;  // used in publish_status() only; 0: at most one server
  bool contest_logged = false;
  messages::ClockReport clocks{"slave_io"};
  messages::CommandService<messages::SensingCommand, messages::SensingReply> commands;
  core::LogRate command_rate;  // of the thread that handles them
};

DdsAdapter::Impl::Participants DdsAdapter::Impl::participants_of(const core::NetworkOptions& network,
                                                                 const PhantomModel& model,
                                                                 const std::vector<std::string>& partitions) {
  Participants participants;
  for (std::size_t i = 0; i < partitions.size(); ++i) {
    if (model.own_share && *model.own_share != i) continue;
    core::NetworkOptions there = network;
    there.partition = partitions[i];
    participants.push_back(std::make_unique<dds::Participant>("phantom_sensing", there));
  }
  return participants;
}

/// Returns the participant that reads a workspace of the own share's own; null: it senses in the arm's.
std::unique_ptr<dds::Participant> DdsAdapter::Impl::participant_apart(const core::NetworkOptions& network,
                                                                      const PhantomModel& model) {
  if (!model.own_share || !model.shares[*model.own_share].has_own_workspace()) return nullptr;
  core::NetworkOptions there = network;
  there.partition = model.shares[*model.own_share].partition;
  return std::make_unique<dds::Participant>("phantom_sensing", there);
}

DdsAdapter::Impl::Participants DdsAdapter::Impl::participants_beside(const core::NetworkOptions& network,
                                                                     std::span<const OtherArm> others) {
  Participants participants;
  for (const OtherArm& other : others) {
    core::NetworkOptions there = network;
    there.partition = other.partition();
    participants.push_back(std::make_unique<dds::Participant>("phantom_sensing", there));
  }
  return participants;
}

DdsAdapter::Impl::ShareReaders::ShareReaders(Impl& owner, SensingLoop& loop, std::size_t share)
    : drag_field(*owner.shares[share], dds::kDragField, bounds_of(owner.model),
                 [&loop, share](const messages::Received<messages::DragField>& field) {
                   loop.offer_share(share, field);
                 }),
      percept(*owner.shares[share], dds::kPercept, bounds_of(owner.model),
              [&loop, share](const messages::Received<messages::Percept>& sample) {
                loop.offer_share(share, sample);
              }) {}

DdsAdapter::Impl::Readers::Readers(Impl& owner, SensingLoop& loop, WorkspaceSubscriber& keeper)
    : slave(owner.participant, dds::kSlaveState, bounds_of(owner.model),
            [&loop](const SlaveSample& sample) { loop.offer(sample); }),
      workspace(std::make_unique<WorkspaceReaders>(owner, keeper)),
      finding(
          owner.of_workspace, dds::kPoseFinding,
          [&owner](const msg::PoseFinding& message, const dds::SampleInfo&) { return owner.take(message); }),
      seen(owner.of_workspace, dds::kSpaceView, {messages::ArmBounds(), {.hold_ns = kSpaceViewHold_ns}},
           [&loop, is_told = false](const messages::Received<messages::SpaceView>& view) mutable {
             loop.know_seen(SeenSpace(view, view.received_ns));
             if (!std::exchange(is_told, true))
               spdlog::info("depth cameras watch the workspace: a percept says where they see nothing");
           }) {
  if (owner.apart) of_arm.emplace(owner);
  if (!owner.model.own_share)
    for (std::size_t i = 0; i < owner.shares.size(); ++i)
      shares.push_back(std::make_unique<ShareReaders>(owner, loop, i));
  for (std::size_t i = 0; i < owner.other_arms.size(); ++i)
    others.push_back(std::make_unique<messages::TopicSubscriber<msg::SlaveState>>(
        *owner.beside[i], dds::kSlaveState, bounds_of(owner.other_arms[i]),
        [&loop, i](const SlaveSample& sample) { loop.offer_other(i, sample); }));
  if (!owner.model.has_fingers()) return;
  gripper.emplace(owner.participant, dds::kGripperState, bounds_of(owner.model),
                  [&loop](const GripperSample& sample) { loop.offer(sample); });
}

DdsAdapter::Impl::WorkspaceReaders::WorkspaceReaders(Impl& owner, WorkspaceSubscriber& workspace)
    : mesh(owner.of_workspace, dds::kMeshChunk,
           [&workspace](const msg::MeshChunk& message, const dds::SampleInfo& info) {
             auto received = messages::from_idl(message);
             if (!received) return workspace.refuse(received.status());
             workspace.put_mesh(info.writer, *std::move(received));
           }),
      version(
          owner.of_workspace, dds::kWorkspaceVersion,
          [&owner, &workspace](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
            const auto received = messages::from_idl(message);
            if (!received) return workspace.refuse(received.status());
            workspace.commit(info.writer, received->description, received->carried);
            const std::lock_guard lock(owner.objects_mutex);
            owner.objects.commit(info.writer, *received);
          },
          [&owner, &workspace](const dds::GuidPrefix& server) {
            workspace.gone(server);
            const std::lock_guard lock(owner.objects_mutex);
            owner.objects.gone(server);
          }),
      brick(
          owner.of_workspace, dds::kWorkspaceBrick,
          [&workspace](const msg::WorkspaceBrick& message, const dds::SampleInfo& info) {
            const auto received = messages::from_idl(message);
            if (!received) return workspace.refuse(received.status());
            workspace.put_brick(info.writer, received->key, received->version,
                                {received->voxels_zstd.begin(), received->voxels_zstd.end()});
          },
          [&workspace](const dds::GuidPrefix& sender) { workspace.gone(sender); }),
      object(owner.of_workspace, dds::kWorkspaceObject,
             [&owner](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
               const auto sample = messages::from_idl(message);
               if (!sample) return false;
               const std::lock_guard lock(owner.objects_mutex);
               return owner.objects.take(info.writer, *sample).accepted;
             }) {}

DdsAdapter::Impl::ObjectReaders::ObjectReaders(Impl& owner)
    : version(
          owner.participant, dds::kWorkspaceVersion,
          [&owner](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
            const auto received = messages::from_idl(message);
            if (!received) return false;
            const std::lock_guard lock(owner.objects_mutex);
            return owner.objects_of_arm.commit(info.writer, *received).accepted;
          },
          [&owner](const dds::GuidPrefix& server) {
            const std::lock_guard lock(owner.objects_mutex);
            owner.objects_of_arm.gone(server);
          }),
      object(owner.participant, dds::kWorkspaceObject,
             [&owner](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
               const auto sample = messages::from_idl(message);
               if (!sample) return false;
               const std::lock_guard lock(owner.objects_mutex);
               return owner.objects_of_arm.take(info.writer, *sample).accepted;
             }) {}

bool DdsAdapter::Impl::take(const msg::PoseFinding& message) {
  auto finding = messages::from_idl(message);
  if (!finding) return false;
  const std::lock_guard lock(objects_mutex);
  return findings.take(*std::move(finding));
}

void DdsAdapter::Impl::suspend(const workspace::SourceId& source) {
  workspace_refusals.refused(
      "a participant sends more of a workspace than is kept beside the one in force; no more is taken from it "
      "until that server has gone");
  of_workspace.suspend(source);
}

/// Some of what was refused had arrived already. DDS sends it once more only to a new reader, unless the
/// participant was discovered anew, which discovery servers do not bring about.
void DdsAdapter::Impl::resume() {
  if (!of_workspace.resume()) return;
  const std::lock_guard lock(readers_mutex);
  if (!readers) return;
  readers->workspace.reset();  // first: its end reports that all writers have gone
  readers->workspace = std::make_unique<WorkspaceReaders>(*this, *keeper);
}

/// Returns whether a second server is present. Logs it once each time one appears.
bool DdsAdapter::Impl::second_server(core::Nanoseconds now_ns) {
  bool contested = false;
  {
    const std::lock_guard lock(readers_mutex);
    contested = keeper != nullptr && keeper->contested();
  }
  if (!contested) {
    contested_since_ns = 0;
    contest_logged = false;
    return false;
  }
  if (contested_since_ns == 0) contested_since_ns = now_ns;
  if (now_ns - contested_since_ns < kSecondServerAfter_ns) return false;
  if (!std::exchange(contest_logged, true))
    spdlog::warn("two processes send workspace_version: only the first is heeded; end one of them");
  return true;
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const PhantomModel& model,
                       const std::vector<std::string>& shares, std::span<const OtherArm> other_arms)
    : impl_(std::make_unique<Impl>(network, model, shares, other_arms)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::start_reading(SensingLoop& loop, WorkspaceSubscriber& workspace) {
  const std::lock_guard lock(impl_->readers_mutex);
  impl_->readers = std::make_unique<Impl::Readers>(*impl_, loop, workspace);
  impl_->keeper = &workspace;
}

void DdsAdapter::stop_reading() {
  std::unique_ptr<Impl::Readers> ended;
  {
    const std::lock_guard lock(impl_->readers_mutex);
    ended = std::move(impl_->readers);
    impl_->keeper = nullptr;
  }
}

WorkspaceSubscriber::Callbacks DdsAdapter::workspace_callbacks() {
  return {.refused =
              [this](const std::string& why) {
                impl_->workspace_refusals.refused(why);
                const std::lock_guard lock(impl_->readers_mutex);
                if (impl_->readers) impl_->readers->workspace->brick.count_refused();
              },
          .excess = [this](const workspace::SourceId& source) { impl_->suspend(source); },
          .unattended = [this] { impl_->resume(); }};
}

bool DdsAdapter::workspace_attended() const {
  const std::lock_guard lock(impl_->readers_mutex);
  return impl_->readers && impl_->readers->workspace->version.matched() > 0;
}

SecondaryWorkspace::Objects DdsAdapter::objects() const {
  std::optional<workspace::SourceId> in_force;
  {
    const std::lock_guard lock(impl_->readers_mutex);
    if (impl_->keeper != nullptr) in_force = impl_->keeper->source();
  }
  const std::lock_guard lock(impl_->objects_mutex);
  return in_force ? impl_->objects.of(*in_force) : impl_->objects.in_force();
}

DisplacedObjects DdsAdapter::displaced() const {
  messages::PoseFindings findings;
  {
    const std::lock_guard lock(impl_->objects_mutex);
    findings = impl_->findings;
  }
  DisplacedObjects displaced;
  if (findings.all().empty()) return displaced;
  const SecondaryWorkspace::Objects all = objects();
  for (const auto& [id, finding] : findings.all())
    if (const auto object = all.find(id);
        object != all.end() && findings.displacing(id, object->second.X_WO) != nullptr)
      displaced.add(id);
  return displaced;
}

std::vector<std::string> DdsAdapter::objects_apart(SecondaryWorkspace& workspaces,
                                                   core::Nanoseconds now_ns) const {
  const SecondaryWorkspace::Objects here = objects();
  const std::lock_guard lock(impl_->objects_mutex);
  return workspaces.compare(
      SecondaryWorkspace::with_carried(here, impl_->objects.carried()),
      SecondaryWorkspace::with_carried(impl_->objects_of_arm.in_force(), impl_->objects_of_arm.carried()),
      now_ns);
}

void DdsAdapter::handle_commands(const std::function<Answer(const messages::SensingCommand&)>& carry_out) {
  while (const auto command = impl_->commands.next()) {
    const Answer answer = carry_out(*command);
    if (messages::is_logged(impl_->command_rate, "requests"))
      spdlog::info("{} asked: {}", command->requester, answer.message);
    impl_->commands.complete(command->stamp, reply_to(*command, answer));
  }
}

void DdsAdapter::publish_skin(const messages::SkinPercept& skin) { impl_->skin_percept.publish(skin); }

void DdsAdapter::publish_status(const core::Health& health) {
  core::Health published = health;
  if (const char* topic = impl_->rival()) published = dds::with_rival(std::move(published), topic);
  if (impl_->second_server(core::monotonic_ns()))
    published = dds::with_rival(std::move(published), "workspace_version");
  {
    const std::lock_guard lock(impl_->readers_mutex);
    if (impl_->readers) {
      messages::add_difference(published, impl_->readers->slave.model_difference());
      impl_->clocks.add_to(published, impl_->readers->slave.clock_difference_s(), core::monotonic_ns());
    }
  }
  impl_->status.publish(published);
}

// Of a share in a workspace of its own, what is carried there stands in place of its version (ShareInbox).
void DdsAdapter::on_drag(const StepOutputs& outputs, const TickInfo& info) {
  messages::DragField field = drag_field_of(outputs, info, impl_->model.arm.joint_count());
  if (impl_->apart) field.workspace_version = outputs.carried_key;
  impl_->drag_field.publish(field);
}

void DdsAdapter::on_percept(const StepOutputs& outputs, const TickInfo& info) {
  messages::Percept percept = percept_of(outputs, info, impl_->model.arm.joint_count());
  if (impl_->apart) percept.workspace_version = outputs.carried_key;
  impl_->percept.publish(percept);
  impl_->interest_points.publish(interest_points_of(outputs, info, impl_->model));
}

void DdsAdapter::on_alert(const percept::Alert& alert, bool cleared) {
  impl_->hit_alert.publish(hit_alert_of(alert, cleared, impl_->model));
}

void DdsAdapter::on_doubt(const percept::ModelDoubt& doubt, bool holds) {
  impl_->model_doubt.publish(model_doubt_of(doubt, holds, impl_->model));
}

}  // namespace phantom::phantom_sensing
