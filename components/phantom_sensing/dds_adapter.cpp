#include "components/phantom_sensing/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <deque>
#include <map>
#include <mutex>
#include <optional>

#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/status_reporter.hpp"
#include "components/phantom_sensing/dds_adapter_messages.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr std::size_t kMostWaiting = 64, kMostRemembered = 64;  // commands; replies

Answer carry_out(const msg::SensingCommand& command, const DdsAdapter::Handlers& handlers) {
  if (command.stamp().sequence_number() == 0)
    return {false, "stamp.sequence_number is 0; allowed: 1 or more"};
  switch (command.request()) {
    case msg::SENSING_ALLOW_CONTACT:
    case msg::SENSING_FORBID_CONTACT:
      return handlers.contact(wish_of(command));
    case msg::SENSING_SELF_TEST:
      return handlers.self_test();
    case msg::SENSING_LIST_CONTACTS:
      return handlers.list_contacts();
    default:
      return {false, "request is " + std::to_string(static_cast<int>(command.request())) +
                         "; allowed: to allow, forbid or list contacts, or a self-test"};
  }
}

}  // namespace

struct DdsAdapter::Impl {
  struct Readers {
    Readers(Impl& owner, SensingLoop& loop, WorkspaceKeeper& workspace);
    dds::SourceGuard source;
    std::atomic<bool> ready{false};  // the first sample may come before the reader's constructor is through
    dds::Reader<msg::SlaveState> slave;
    dds::Reader<msg::WorkspaceVersion> version;
    dds::Reader<msg::WorkspaceBrick> brick;
    dds::Reader<msg::WorkspaceObject> object;
    dds::Reader<msg::SensingCommand> command;
  };

  Impl(const core::NetworkOptions& network, const PhantomModel& phantom)
      : model(phantom),
        participant("phantom_sensing", network),
        status(participant),
        drag_stamper(participant),
        percept_stamper(participant),
        alert_stamper(participant),
        interest_stamper(participant),
        skin_stamper(participant),
        reply_stamper(participant),
        drag_writer(participant, dds::kDragField),
        percept_writer(participant, dds::kPercept),
        alert_writer(participant, dds::kHitAlert),
        interest_writer(participant, dds::kInterestPoints),
        skin_writer(participant, dds::kSkinPercept),
        reply_writer(participant, dds::kSensingReply) {}

  /// A wish that comes again gets the reply it got.
  const msg::SensingReply* given_before(const msg::Stamp& stamp) const {
    for (const msg::SensingReply& reply : given) {
      if (reply.command().session() == stamp.session() &&
          reply.command().sequence_number() == stamp.sequence_number())
        return &reply;
    }
    return nullptr;
  }

  bool has_rival() {
    const std::lock_guard lock(readers_mutex);
    return readers && readers->source.has_rival(core::monotonic_ns());
  }

  const PhantomModel& model;
  dds::Participant participant;
  dds::StatusReporter status;
  dds::Stamper drag_stamper, percept_stamper, alert_stamper, interest_stamper, skin_stamper, reply_stamper;
  dds::Writer<msg::DragField> drag_writer;
  dds::Writer<msg::Percept> percept_writer;
  dds::Writer<msg::HitAlert> alert_writer;
  dds::Writer<msg::InterestPoints> interest_writer;
  dds::Writer<msg::SkinPercept> skin_writer;
  dds::Writer<msg::SensingReply> reply_writer;
  msg::DragField drag;
  msg::Percept percept;
  msg::HitAlert alert;
  msg::InterestPoints interest;
  core::Snapshot<SlaveSample> newest_slave;
  std::deque<msg::SensingReply> given;  // handle_commands() only
  mutable std::mutex inbox_mutex;       // commands, objects
  std::deque<msg::SensingCommand> commands;
  std::map<std::uint16_t, std::string> objects;
  dds::RefusalLog slave_refusals{"slave_state"}, workspace_refusals{"workspace_brick, workspace_version"};
  std::mutex readers_mutex;  // between stop_reading() and the keeper's thread
  std::unique_ptr<Readers> readers;
};

DdsAdapter::Impl::Readers::Readers(Impl& owner, SensingLoop& loop, WorkspaceKeeper& workspace)
    : slave(owner.participant, dds::kSlaveState,
            [&owner, &loop, this](const msg::SlaveState& state, const dds::SampleInfo& info) {
              if (!ready.load(std::memory_order_acquire)) return;
              std::string why = refusal(state, owner.model.arm);
              if (why.empty()) {
                const char* refused = dds::reason(source.judge(state.stamp(), info.received_ns));
                if (refused != nullptr) why = refused;
              }
              if (why.empty()) {
                const SlaveSample sample = sample_of(state, info.received_ns);
                loop.offer(sample);
                owner.newest_slave.write(sample);
              } else {
                slave.count_refused();
                owner.slave_refusals.refused(why);
              }
            }),
      version(owner.participant, dds::kWorkspaceVersion,
              [&workspace, &loop](const msg::WorkspaceVersion& sample, const dds::SampleInfo&) {
                loop.workspace_watch().announced(sample.version());
                workspace.commit(description_of(sample));
              }),
      brick(owner.participant, dds::kWorkspaceBrick,
            [&workspace](const msg::WorkspaceBrick& sample, const dds::SampleInfo&) {
              workspace.put_brick({sample.bx(), sample.by(), sample.bz()}, sample.version(),
                                  sample.voxels_zstd());
            }),
      object(owner.participant, dds::kWorkspaceObject,
             [&owner](const msg::WorkspaceObject& sample, const dds::SampleInfo&) {
               const std::lock_guard lock(owner.inbox_mutex);
               if (sample.mesh_hash() == 0) {  // removed
                 owner.objects.erase(sample.id());
               } else {
                 owner.objects[sample.id()] = sample.name().to_string();
               }
             }),
      command(owner.participant, dds::kSensingCommand,
              [&owner](const msg::SensingCommand& sample, const dds::SampleInfo&) {
                const std::lock_guard lock(owner.inbox_mutex);
                if (owner.commands.size() < kMostWaiting) owner.commands.push_back(sample);
              }) {}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const PhantomModel& model)
    : impl_(std::make_unique<Impl>(network, model)) {}
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

bool DdsAdapter::workspace_attended() const {
  const std::lock_guard lock(impl_->readers_mutex);
  return impl_->readers && impl_->readers->version.matched() > 0;
}

std::map<std::uint16_t, std::string> DdsAdapter::objects() const {
  const std::lock_guard lock(impl_->inbox_mutex);
  return impl_->objects;
}

void DdsAdapter::handle_commands(const Handlers& handlers) {
  std::deque<msg::SensingCommand> commands;
  {
    const std::lock_guard lock(impl_->inbox_mutex);
    commands.swap(impl_->commands);
  }
  for (const msg::SensingCommand& command : commands) {
    msg::SensingReply reply;
    if (const msg::SensingReply* before = impl_->given_before(command.stamp())) {
      reply = *before;
    } else {
      const Answer answer = carry_out(command, handlers);
      spdlog::info("{} asked: {}", command.requester().to_string(), answer.message);
      reply = reply_to(command, answer);
      impl_->given.push_back(reply);
      if (impl_->given.size() > kMostRemembered) impl_->given.pop_front();
    }
    reply.stamp(impl_->reply_stamper.next());
    impl_->reply_writer.write(reply);
  }
}

bool DdsAdapter::newest_slave(SlaveSample& sample) { return impl_->newest_slave.read(sample); }

void DdsAdapter::publish_skin(const SkinView& view) {
  msg::SkinPercept message;
  fill(message, view);
  message.stamp(impl_->skin_stamper.next());
  impl_->skin_writer.write(message);
}

void DdsAdapter::publish_status(const core::Health& health) {
  impl_->status.publish(impl_->has_rival() ? dds::with_rival(health, "slave_state") : health);
}

void DdsAdapter::on_drag(const StepOutputs& outputs, const TickInfo& info) {
  fill(impl_->drag, outputs, info, impl_->model.arm.joint_count());
  impl_->drag.stamp(impl_->drag_stamper.next());
  impl_->drag_writer.write(impl_->drag);
}

void DdsAdapter::on_percept(const StepOutputs& outputs, const TickInfo& info) {
  fill(impl_->percept, outputs, info, impl_->model.arm.joint_count());
  impl_->percept.stamp(impl_->percept_stamper.next());
  impl_->percept_writer.write(impl_->percept);
  fill(impl_->interest, outputs, info, impl_->model);
  impl_->interest.stamp(impl_->interest_stamper.next());
  impl_->interest_writer.write(impl_->interest);
}

void DdsAdapter::on_alert(const percept::Alert& alert, bool cleared) {
  fill(impl_->alert, alert, cleared, impl_->model);
  impl_->alert.stamp(impl_->alert_stamper.next());
  impl_->alert_writer.write(impl_->alert);
}

}  // namespace phantom::phantom_sensing
