#include "components/synthetic_viewer/topics/dds_adapter.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/dds/admission/refusal_log.hpp"
#include "common/haptic_device/handle_service.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/operator_client.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/requester.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/messages/workspace_follower.hpp"
#include "components/synthetic_viewer/state/model_corrections.hpp"
#include "components/synthetic_viewer/topics/dds_adapter_intake.hpp"

namespace phantom::synthetic_viewer {
namespace {

// The time in which a stop is confirmed, plus two network delays.
constexpr double kStopAnswer_s = core::seconds(teleop::kStopConfirmedWithin_ns) + 0.05;
constexpr double kAnswer_s = 0.5;
constexpr std::size_t kMaxWorkspaceBytes = std::size_t{2} << 30;

}  // namespace

struct DdsAdapter::Impl {
  Inbox& inbox;
  dds::Participant participant;
  messages::OperatorClient operator_client;
  std::mutex workspace_mutex;
  messages::Requester<messages::WorkspaceCommand, messages::WorkspaceReply> workspace_requester;
  std::optional<messages::Publisher<messages::ViewPose>> view_poses;
  std::optional<messages::Publisher<messages::ViewPicture>> pictures;
  // The newest picture of each view.
  std::array<web::Broadcast<std::string>::Content, kViews.size()> published;
  bool follows_pictures = false;
  core::Nanoseconds pictures_due_ns = 0;
  messages::StatusReporter status;

  SampleFilter intake;       // each topic's on the thread of its reader's callbacks
  std::mutex servers_mutex;  // for the intake of workspace_object and workspace_version, and the next
  ModelCorrections corrections;
  ArmSample newest_arm;          // used on the callback thread of hit alerts
  PerceptSample newest_percept;  // likewise

  std::mutex follower_mutex;
  std::unique_ptr<messages::WorkspaceFollower> follower;  // guarded by follower_mutex; null: nobody asks
  core::Nanoseconds workspace_asked_ns = 0;               // likewise

  // Declared last, so that their callbacks end before the members that they use are destroyed.
  std::optional<dds::Reader<msg::SlaveState>> arm;
  std::optional<dds::Reader<msg::MasterState>> master;
  std::optional<dds::Reader<msg::GripperState>> gripper;
  std::optional<dds::Reader<msg::Percept>> percept;
  std::optional<dds::Reader<msg::HitAlert>> hits;
  std::optional<dds::Reader<msg::ModelDoubt>> doubts;
  std::optional<dds::Reader<msg::SkinPercept>> skin;
  std::optional<dds::Reader<msg::WorkspaceVersion>> versions;
  std::optional<dds::Reader<msg::WorkspaceObject>> objects;
  std::optional<dds::Reader<msg::ObjectUncertainty>> uncertainties;
  std::optional<dds::Reader<msg::PoseFinding>> findings;
  std::optional<dds::Reader<msg::LiveObject>> live_objects;
  std::optional<dds::Reader<msg::MeshChunk>> chunks;
  std::optional<dds::Reader<msg::ComponentStatus>> components;
  std::optional<dds::Reader<msg::OperatorCommand>> view_commands;
  std::optional<dds::Reader<msg::CameraPicture>> video;

  /// Where another arm's states come from.
  struct Other {
    Other(const core::NetworkOptions& there, const messages::ArmBounds& bounds, Inbox& inbox, std::size_t i)
        : participant("synthetic_viewer", there),
          arm(participant, dds::kSlaveState, bounds,
              [&inbox, i](const messages::Received<messages::SlaveState>& state) {
                const ArmSample sample(state, state.received_ns);
                inbox.past.others[i].take(sample);
                inbox.others[i].write(sample);
              }) {}
    dds::Participant participant;
    messages::TopicSubscriber<msg::SlaveState> arm;
  };
  std::vector<std::unique_ptr<Other>> others;
  dds::RefusalLog hand_refusals{"handles of a headset"};
  std::optional<haptic_device::HandleService> hand;

  Impl(const core::NetworkOptions& network, const messages::ArmBounds& bounds, Inbox& viewer_inbox,
       const std::string& camera)
      : inbox(viewer_inbox),
        participant("synthetic_viewer", network),
        operator_client(
            participant,
            [this](const std::optional<teleop::CommandAnswers>& stop) { inbox.stops.take_request(stop); }),
        workspace_requester(participant, dds::kWorkspaceCommand, dds::kWorkspaceReply),
        status(participant),
        intake(bounds) {
    open_states();
    open_events();
    open_workspace();
    if (!camera.empty()) open_video(camera);
  }

  void notify_client(teleop::Side side, const auto& sample) {
    operator_client.take_state(side, sample.stamp.session,
                               sample.state == LinkState::kStopped ? sample.stop.id : 0, sample.received_ns);
  }
  Command completed(Command command) const;
  void remember(const ArmSample& sample) { inbox.past.arms.take(sample); }
  void remember(const PerceptSample& sample) { inbox.past.percepts.take(sample); }
  void remember(const GripperSample& sample) { inbox.past.grippers.take(sample); }
  void remember(const MasterSample&) {}

  /// Writes the states of a topic that are heeded to a snapshot.
  template <class T, class Sample, std::uint32_t Readers>
  auto to_snapshot(const dds::TopicSpec<T>& /*topic*/, core::Snapshot<Sample, Readers>& snapshot) {
    return [this, &snapshot](const T& message, const dds::SampleInfo& info) {
      const auto sample = intake.take(message, info.received_ns, inbox.stops);
      if (!sample) return false;
      remember(*sample);
      if constexpr (std::is_same_v<Sample, ArmSample>) {
        notify_client(teleop::Side::kSlave, *sample);
      } else if constexpr (std::is_same_v<Sample, MasterSample>) {
        notify_client(teleop::Side::kMaster, *sample);
      }
      snapshot.write(*sample);
      return true;
    };
  }
  void open_states();
  void open_events();
  void open_workspace();
  void open_video(const std::string& camera);
  void put(const std::vector<messages::WorkspaceObject>& changes) {
    for (const messages::WorkspaceObject& object : changes) {
      corrections.take(object);
      inbox.put(object);
    }
  }
  /// Returns whether the version in force is another one now.
  bool put(SampleFilter::Version taken) {
    put(taken.changes);
    if (!taken.workspace) return false;
    corrections.take(taken.workspace->version, taken.workspace->carried);
    inbox.put(*std::move(taken.workspace));
    return true;
  }
  static core::Expected<messages::WorkspaceCommand> command_of(const CarryRequest& request);
  core::Expected<messages::WorkspaceCommand> command_of(const CorrectionRequest& request);
};

void DdsAdapter::Impl::open_states() {
  arm.emplace(participant, dds::kSlaveState, to_snapshot(dds::kSlaveState, inbox.arm));
  master.emplace(participant, dds::kMasterState, to_snapshot(dds::kMasterState, inbox.master));
  gripper.emplace(participant, dds::kGripperState, to_snapshot(dds::kGripperState, inbox.gripper));
  percept.emplace(participant, dds::kPercept, to_snapshot(dds::kPercept, inbox.percept));
}

void DdsAdapter::Impl::open_events() {
  hits.emplace(participant, dds::kHitAlert,
               [this](const msg::HitAlert& message, const dds::SampleInfo& info) {
                 auto hit = intake.take(message, info.received_ns, inbox.stops);
                 if (!hit) return false;
                 inbox.arm.read<Inbox::kAlerts>(newest_arm);
                 inbox.percept.read<Inbox::kAlerts>(newest_percept);
                 hit->arm = newest_arm;
                 hit->percept = newest_percept;
                 inbox.put(std::move(*hit));
                 return true;
               });
  doubts.emplace(participant, dds::kModelDoubt,
                 [this](const msg::ModelDoubt& message, const dds::SampleInfo& info) {
                   auto doubt = SampleFilter::take(message, info.received_ns);
                   if (!doubt) return false;
                   {
                     const std::lock_guard lock(servers_mutex);
                     corrections.take(*doubt);
                   }
                   return inbox.put(*std::move(doubt));
                 });
  skin.emplace(participant, dds::kSkinPercept,
               [this](const msg::SkinPercept& message, const dds::SampleInfo& info) {
                 auto sample = intake.take(message, info.received_ns, inbox.stops);
                 if (!sample) return false;
                 inbox.put(std::move(*sample));
                 return true;
               });
  components.emplace(participant, dds::kComponentStatus,
                     [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                       auto sample = intake.take(message, info.received_ns, inbox.stops);
                       return sample && inbox.put(std::move(*sample));
                     });
  view_commands.emplace(participant, dds::kOperatorCommand,
                        [this](const msg::OperatorCommand& message, const dds::SampleInfo&) {
                          auto command = SampleFilter::view_command(message);
                          if (!command) return false;
                          if (command->has_value()) inbox.put(std::move(**command));
                          return true;
                        });
}

void DdsAdapter::Impl::open_workspace() {
  objects.emplace(participant, dds::kWorkspaceObject,
                  [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
                    const std::lock_guard lock(servers_mutex);
                    const auto taken = intake.take(message, info.writer);
                    put(taken.changes);
                    return taken.accepted;
                  });
  versions.emplace(
      participant, dds::kWorkspaceVersion,
      [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
        const std::lock_guard lock(servers_mutex);
        return put(intake.take(message, info.writer));
      },
      [this](const dds::GuidPrefix& server) {
        const std::lock_guard lock(servers_mutex);
        put(intake.gone(server));
      });
  uncertainties.emplace(participant, dds::kObjectUncertainty,
                        [this](const msg::ObjectUncertainty& message, const dds::SampleInfo&) {
                          const auto uncertainty = messages::from_idl(message);
                          return uncertainty && inbox.put(*uncertainty);
                        });
  findings.emplace(participant, dds::kPoseFinding,
                   [this](const msg::PoseFinding& message, const dds::SampleInfo&) {
                     auto finding = messages::from_idl(message);
                     if (!finding) return false;
                     {
                       const std::lock_guard lock(servers_mutex);
                       corrections.take(*finding);
                     }
                     return inbox.put(*std::move(finding));
                   });
  live_objects.emplace(participant, dds::kLiveObject,
                       [this](const msg::LiveObject& message, const dds::SampleInfo&) {
                         auto object = messages::from_idl(message);
                         return object && inbox.put(*std::move(object));
                       });
  chunks.emplace(participant, dds::kMeshChunk, [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
    auto chunk = messages::from_idl(message);
    if (!chunk) return false;
    return inbox.put(std::move(*chunk));
  });
}

void DdsAdapter::Impl::open_video(const std::string& camera) {
  video.emplace(participant, dds::kCameraPicture,
                [this, camera](const msg::CameraPicture& message, const dds::SampleInfo& info) {
                  const core::Nanoseconds utc_ns = core::utc_ns() - (core::monotonic_ns() - info.received_ns);
                  auto picture = intake.take(message, camera, info.received_ns, utc_ns, inbox.stops);
                  if (!picture) return inbox.video.refuse(picture.status().message()), false;
                  if (!picture->has_value()) return inbox.video.put_foreign(message.camera().c_str()), true;
                  inbox.video.put(std::move(**picture));
                  return true;
                });
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const messages::ArmBounds& arm, Inbox& inbox,
                       const std::string& camera, const std::vector<OtherArmSource>& others)
    : impl_(std::make_unique<Impl>(network, arm, inbox, camera)) {
  for (std::size_t i = 0; i < others.size(); ++i) {
    core::NetworkOptions there = network;
    there.partition = others[i].partition;
    impl_->others.push_back(std::make_unique<Impl::Other>(there, others[i].bounds, inbox, i));
  }
}

DdsAdapter::~DdsAdapter() = default;

Command DdsAdapter::Impl::completed(Command command) const {
  command.issuer = "operator's page";
  if (command.kind == CommandKind::kReset) {
    command.master_stop = inbox.stops.stop_of(teleop::Side::kMaster);
    command.slave_stop = inbox.stops.stop_of(teleop::Side::kSlave);
  }
  return command;
}

CommandOutcome DdsAdapter::ask(const Command& command) {
  using Kind = CommandOutcome::Kind;
  const bool stop = command.kind == CommandKind::kEmergencyStop;
  const teleop::CommandAnswers answers =
      impl_->operator_client.ask(impl_->completed(command), stop ? kStopAnswer_s : kAnswer_s);
  return {answers.done()      ? Kind::kDone
          : answers.refused() ? Kind::kRefused
                              : Kind::kUnanswered,
          stop ? teleop::stop_words(answers) : teleop::command_words(answers)};
}

core::Expected<messages::WorkspaceCommand> DdsAdapter::Impl::command_of(const CarryRequest& request) {
  messages::WorkspaceCommand command;
  command.operation =
      request.attach ? messages::WorkspaceOperation::kAttach : messages::WorkspaceOperation::kRelease;
  command.object = request.object;
  return command;
}

core::Expected<messages::WorkspaceCommand> DdsAdapter::Impl::command_of(const CorrectionRequest& request) {
  const std::lock_guard lock(servers_mutex);
  if (!request.undo.empty()) return corrections.undo(request.undo);
  if (!request.live.empty()) {
    messages::WorkspaceCommand command;
    command.operation = request.decision;
    command.object = request.live;
    command.description = request.name;
    return command;
  }
  return request.found.empty() ? corrections.correct(request.doubt) : corrections.accept(request.found);
}

CommandOutcome DdsAdapter::change(const WorkspaceRequest& request) {
  using Kind = CommandOutcome::Kind;
  auto asked = std::visit([this](const auto& one) { return impl_->command_of(one); }, request);
  if (!asked) return {Kind::kRefused, asked.status().message()};
  messages::WorkspaceCommand command = *std::move(asked);
  command.requester = messages::requester_name("operator's page");
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

std::shared_ptr<const workspace::Workspace> DdsAdapter::workspace() {
  const std::lock_guard lock(impl_->follower_mutex);
  if (!impl_->follower)
    impl_->follower = std::make_unique<messages::WorkspaceFollower>(impl_->participant, kMaxWorkspaceBytes);
  auto newest = impl_->follower->take();
  impl_->workspace_asked_ns = core::monotonic_ns();
  return newest;
}

void DdsAdapter::release_workspace() {
  const std::unique_lock lock(impl_->follower_mutex, std::try_to_lock);
  if (lock && core::monotonic_ns() - impl_->workspace_asked_ns > core::from_seconds(kWorkspaceKept_s))
    impl_->follower.reset();
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
    for (std::size_t view = 0; view < kViews.size(); ++view)
      page.views[view].jpeg.followers.fetch_add(wanted ? 1 : -1);
  impl_->follows_pictures = wanted;
  for (std::size_t view = 0; wanted && view < kViews.size(); ++view) {
    const auto newest = page.views[view].jpeg.newest();
    if (!newest || newest == impl_->published[view] || newest->size() > messages::kMaxPictureBytes) continue;
    impl_->published[view] = newest;
    impl_->pictures->publish({.stamp = {},
                              .view = static_cast<messages::PictureView>(view),
                              .jpeg = {newest->begin(), newest->end()}});
  }
}

void DdsAdapter::serve(HeadsetHand& hand) {
  impl_->hand.emplace(
      impl_->participant, HeadsetHand::kHandle,
      [&hand](const haptic_device::HapticClient::Felt& felt, const robot::Spatial& wrench, double dt_s,
              core::Nanoseconds now_ns) {
        const auto handle = hand.step({wrench, felt.valid, felt.leads}, dt_s, now_ns);
        return haptic_device::HandleService::Handle{handle.hand, handle.grip_opening};
      },
      [this](const std::string& why) { impl_->hand_refusals.refused(why); });
}

void DdsAdapter::publish(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::synthetic_viewer
