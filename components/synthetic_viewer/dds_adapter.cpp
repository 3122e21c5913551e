#include "components/synthetic_viewer/dds_adapter.hpp"

#include <Eigen/Geometry>
#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"

namespace phantom::synthetic_viewer {
namespace {

/// A reader that its own callback can name: samples may come before its constructor has returned.
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

}  // namespace

struct DdsAdapter::Impl {
  Inbox& inbox;
  ArmShape shape;
  dds::Participant participant;
  dds::Stamper stamper;
  std::mutex sending;
  dds::Writer<msg::OperatorCommand> commands;
  std::optional<dds::Writer<msg::ViewPose>> view_poses;
  dds::Stamper view_stamper;
  dds::StatusReporter status;

  // Each belongs to the thread of its reader's callbacks.
  dds::SequenceGuard arm_order, master_order, percept_order, hit_order, skin_order;
  std::uint64_t arm_arrived = 0;
  core::Snapshot<ArmSample> arm_for_hits;                     // read by the thread of hits alone
  core::Snapshot<PerceptSample> percept_for_hits;             // likewise
  ArmSample newest_arm;                                       // that thread's
  PerceptSample newest_percept;                               // likewise
  std::map<std::string, dds::SequenceGuard> component_order;  // by name and host

  // Last, so that their callbacks end before what they use.
  Input<msg::SlaveState> arm;
  Input<msg::MasterState> master;
  Input<msg::Percept> percept;
  Input<msg::HitAlert> hits;
  Input<msg::SkinPercept> skin;
  Input<msg::WorkspaceVersion> versions;
  Input<msg::WorkspaceObject> objects;
  Input<msg::MeshChunk> chunks;
  Input<msg::ComponentStatus> components;
  Input<msg::OperatorCommand> wishes;

  Impl(const core::NetworkOptions& network, const ArmShape& arm_shape, Inbox& viewer_inbox)
      : inbox(viewer_inbox),
        shape(arm_shape),
        participant("synthetic_viewer", network),
        stamper(participant),
        commands(participant, dds::kOperatorCommand),
        view_stamper(participant),
        status(participant) {
    open_states();
    open_events();
    open_workspace();
  }

  /// Newest state: to a snapshot, if it is sound and newer than the last.
  template <class T, class Sample>
  auto to_snapshot(Input<T>& input, dds::SequenceGuard& order, core::Snapshot<Sample>& snapshot) {
    return [this, &input, &order, &snapshot](const T& message, const dds::SampleInfo& info) {
      auto sample = convert(message, shape);
      if (!sample || !order.accept(message.stamp())) return input.refuse();
      sample->received_ns = info.received_ns;
      if constexpr (std::is_same_v<Sample, ArmSample>) {
        sample->arrived = ++arm_arrived;
        sample->lost = order.lost();
        arm_for_hits.write(*sample);
      } else if constexpr (std::is_same_v<Sample, PerceptSample>) {
        percept_for_hits.write(*sample);
      }
      snapshot.write(*sample);
    };
  }
  void open_states();
  void open_events();
  void open_workspace();
};

void DdsAdapter::Impl::open_states() {
  arm.open(participant, dds::kSlaveState, to_snapshot(arm, arm_order, inbox.arm));
  master.open(participant, dds::kMasterState, to_snapshot(master, master_order, inbox.master));
  percept.open(participant, dds::kPercept, to_snapshot(percept, percept_order, inbox.percept));
}

void DdsAdapter::Impl::open_events() {
  hits.open(participant, dds::kHitAlert, [this](const msg::HitAlert& message, const dds::SampleInfo& info) {
    auto hit = convert(message, shape);
    if (!hit || !hit_order.accept(message.stamp())) return hits.refuse();
    hit->received_ns = info.received_ns;
    arm_for_hits.read(newest_arm);
    percept_for_hits.read(newest_percept);
    hit->arm = newest_arm;
    hit->percept = newest_percept;
    inbox.put(std::move(*hit));
  });
  skin.open(participant, dds::kSkinPercept,
            [this](const msg::SkinPercept& message, const dds::SampleInfo& info) {
              auto sample = convert(message, shape);
              if (!sample || !skin_order.accept(message.stamp())) return skin.refuse();
              sample->received_ns = info.received_ns;
              inbox.put(std::move(*sample));
            });
  components.open(participant, dds::kComponentStatus,
                  [this](const msg::ComponentStatus& message, const dds::SampleInfo& info) {
                    auto component = convert(message);
                    if (!component) return components.refuse();
                    auto& order = component_order[component->name + "@" + component->host];
                    if (!order.accept(message.stamp())) return components.refuse();
                    component->received_ns = info.received_ns;
                    inbox.put(std::move(*component));
                  });
  wishes.open(participant, dds::kOperatorCommand,
              [this](const msg::OperatorCommand& message, const dds::SampleInfo&) {
                // Many may write commands, so their numbers say nothing about order between them.
                const auto command = convert(message);
                if (!command) return wishes.refuse();
                inbox.put(*command);
              });
}

void DdsAdapter::Impl::open_workspace() {
  objects.open(participant, dds::kWorkspaceObject,
               [this](const msg::WorkspaceObject& message, const dds::SampleInfo&) {
                 if (message.mesh_hash() == 0) {
                   inbox.put(ObjectGone{message.id()});
                   return;
                 }
                 auto object = convert(message);
                 if (!object) return objects.refuse();
                 inbox.put(std::move(*object));
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

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const ArmShape& shape, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, shape, inbox)) {}

DdsAdapter::~DdsAdapter() = default;

core::Status DdsAdapter::send(const Command& command) {
  msg::OperatorCommand message;
  message.kind(static_cast<msg::CommandKind>(command.kind));
  message.value(command.value);
  message.issuer("operator's page");
  const std::lock_guard lock(impl_->sending);
  message.stamp(impl_->stamper.next());
  if (impl_->commands.write(message)) return core::Status::ok();
  return {core::ErrorCode::kUnavailable, "the command could not be published"};
}

void DdsAdapter::publish(const ViewPoseSample& view) {
  // Made with the first pose: an onlooker's viewer tells none, and must not be missed.
  if (!impl_->view_poses) impl_->view_poses.emplace(impl_->participant, dds::kViewPose);
  msg::ViewPose message;
  message.stamp(impl_->view_stamper.next());
  message.view(view.hit_zone ? msg::VIEW_HIT : msg::VIEW_MAIN);
  message.node(static_cast<std::uint32_t>(view.node));
  message.automatic(view.automatic);
  const Eigen::Quaterniond q(view.X_WC.rotation);
  message.X_WC().qx(q.x());
  message.X_WC().qy(q.y());
  message.X_WC().qz(q.z());
  message.X_WC().qw(q.w());
  const Eigen::Vector3d& eye_m = view.X_WC.translation_m;
  message.X_WC().position_m().x(eye_m.x());
  message.X_WC().position_m().y(eye_m.y());
  message.X_WC().position_m().z(eye_m.z());
  message.look_at_m().x(view.look_at_m[0]);
  message.look_at_m().y(view.look_at_m[1]);
  message.look_at_m().z(view.look_at_m[2]);
  impl_->view_poses->write(message);
}

void DdsAdapter::publish(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::synthetic_viewer
