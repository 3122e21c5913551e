#include "components/phantom_sensing/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <map>
#include <mutex>
#include <optional>

#include "common/dds/status_reporter.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"

namespace phantom::phantom_sensing {
namespace {

/// Says what is wrong with a topic's samples, not once per sample. Thread-safe.
class RefusalLog {
 public:
  explicit RefusalLog(const char* topic) : topic_(topic) {}
  void refused(const std::string& why) {
    const std::lock_guard lock(mutex_);
    ++count_;
    const core::Nanoseconds now = core::monotonic_ns();
    if (said_ns_ != 0 && now - said_ns_ < 5 * core::kNsPerSecond) return;
    said_ns_ = now;
    spdlog::warn("{}: refused: {} ({} refused so far)", topic_, why, count_);
  }

 private:
  const char* topic_;
  std::mutex mutex_;
  std::uint64_t count_ = 0;
  core::Nanoseconds said_ns_ = 0;
};

}  // namespace

struct DdsAdapter::Impl {
  struct Readers {
    Readers(Impl& owner, SensingLoop& loop, WorkspaceKeeper& workspace);
    std::map<dds::InstanceId, voxel::BrickKey> brick_of;  // a disposed instance comes without its key
    dds::SequenceGuard order;
    std::atomic<bool> ready{false};  // the first sample may come before the reader's constructor is through
    dds::Reader<msg::SlaveState> slave;
    dds::Reader<msg::WorkspaceVersion> version;
    dds::Reader<msg::WorkspaceBrick> brick;
  };

  Impl(const core::NetworkOptions& network, const robot::SerialArm& robot_arm)
      : arm(robot_arm),
        participant("phantom_sensing", network),
        status(participant),
        drag_stamper(participant),
        percept_stamper(participant),
        alert_stamper(participant),
        drag_writer(participant, dds::kDragField),
        percept_writer(participant, dds::kPercept),
        alert_writer(participant, dds::kHitAlert) {}

  const robot::SerialArm& arm;
  dds::Participant participant;
  dds::StatusReporter status;
  dds::Stamper drag_stamper, percept_stamper, alert_stamper;
  dds::Writer<msg::DragField> drag_writer;
  dds::Writer<msg::Percept> percept_writer;
  dds::Writer<msg::HitAlert> alert_writer;
  msg::DragField drag;
  msg::Percept percept;
  msg::HitAlert alert;
  RefusalLog slave_refusals{"slave_state"}, workspace_refusals{"workspace_brick, workspace_version"};
  std::mutex readers_mutex;  // between stop_reading() and the keeper's thread
  std::unique_ptr<Readers> readers;
};

DdsAdapter::Impl::Readers::Readers(Impl& owner, SensingLoop& loop, WorkspaceKeeper& workspace)
    : slave(owner.participant, dds::kSlaveState,
            [&owner, &loop, this](const msg::SlaveState& state, const dds::SampleInfo& info) {
              if (!ready.load(std::memory_order_acquire)) return;
              std::string why = refusal(state, owner.arm);
              if (why.empty() && !order.accept(state.stamp())) {
                why = "stamp.sequence_number " + std::to_string(state.stamp().sequence_number()) +
                      " is not above the one before; allowed: rising numbers";
              }
              if (why.empty()) {
                loop.offer(sample_of(state, info.received_ns));
              } else {
                slave.count_refused();
                owner.slave_refusals.refused(why);
              }
            }),
      version(owner.participant, dds::kWorkspaceVersion,
              [&workspace](const msg::WorkspaceVersion& sample, const dds::SampleInfo&) {
                workspace.commit(description_of(sample));
              }),
      brick(
          owner.participant, dds::kWorkspaceBrick,
          [&workspace, this](const msg::WorkspaceBrick& sample, const dds::SampleInfo& info) {
            const voxel::BrickKey key{sample.bx(), sample.by(), sample.bz()};
            brick_of[info.instance] = key;
            workspace.put_brick(key, sample.version(), sample.voxels_zstd());
          },
          [&workspace, this](const dds::InstanceId& instance) {
            const auto found = brick_of.find(instance);
            if (found == brick_of.end()) return;  // never had it
            workspace.remove_brick(found->second);
            brick_of.erase(found);
          }) {}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const robot::SerialArm& arm)
    : impl_(std::make_unique<Impl>(network, arm)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::start_reading(SensingLoop& loop, WorkspaceKeeper& workspace) {
  const std::lock_guard lock(impl_->readers_mutex);
  impl_->readers = std::make_unique<Impl::Readers>(*impl_, loop, workspace);
  impl_->readers->ready.store(true, std::memory_order_release);
}

void DdsAdapter::stop_reading() {
  std::unique_ptr<Impl::Readers> ended;
  {
    const std::lock_guard lock(impl_->readers_mutex);
    ended = std::move(impl_->readers);
  }
}

void DdsAdapter::count_refused_workspace(const std::string& why) {
  impl_->workspace_refusals.refused(why);
  const std::lock_guard lock(impl_->readers_mutex);
  if (impl_->readers) impl_->readers->brick.count_refused();
}

void DdsAdapter::publish_status(const core::Health& health) { impl_->status.publish(health); }

void DdsAdapter::on_drag(const StepOutputs& outputs, const TickInfo& info) {
  fill(impl_->drag, outputs, info, impl_->arm.joint_count());
  impl_->drag.stamp(impl_->drag_stamper.next());
  impl_->drag_writer.write(impl_->drag);
}

void DdsAdapter::on_percept(const StepOutputs& outputs, const TickInfo& info) {
  fill(impl_->percept, outputs, info, impl_->arm.joint_count());
  impl_->percept.stamp(impl_->percept_stamper.next());
  impl_->percept_writer.write(impl_->percept);
}

void DdsAdapter::on_alert(const percept::Alert& alert, bool cleared) {
  fill(impl_->alert, alert, cleared, impl_->arm);
  impl_->alert.stamp(impl_->alert_stamper.next());
  impl_->alert_writer.write(impl_->alert);
}

}  // namespace phantom::phantom_sensing
