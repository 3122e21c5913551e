#include "components/slave_io/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>

#include "common/dds/endpoint.hpp"
#include "common/dds/participant.hpp"
#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "components/slave_io/dds_adapter_convert.hpp"

namespace phantom::slave_io {

const char* refusal(const msg::MasterState& master, std::size_t joint_count) noexcept {
  if (master.stamp().sequence_number() == 0) return "it has no sequence number";
  if (master.joint_count() != joint_count) return "its joint count is not this arm's";
  if (!core::all_finite(master.position_rad(), joint_count)) return "a position is not a finite number";
  if (!core::all_finite(master.velocity_rad_s(), joint_count)) return "a velocity is not a finite number";
  if (master.state() > msg::LINK_STOPPED) return "its state is not known";
  return nullptr;
}

MasterSample to_sample(const msg::MasterState& master, core::Nanoseconds received_ns,
                       std::uint64_t own_session) noexcept {
  const auto& echo = master.slave_echo();
  return {received_ns,
          dds::id_of(master.stamp()),
          dds::answered_ns(echo, own_session, received_ns),
          echo.session() != 0 && echo.session() != own_session,
          static_cast<teleop::LinkState>(master.state()),
          master.position_rad(),
          master.velocity_rad_s()};
}

bool count_request(const msg::OperatorCommand& command, teleop::StopRequests& requests) noexcept {
  if (command.stamp().sequence_number() == 0 || command.kind() > msg::COMMAND_MARK) return false;
  if (command.kind() == msg::COMMAND_EMERGENCY_STOP) requests.stop();
  if (command.kind() == msg::COMMAND_RESET) requests.reset();
  return true;
}

msg::SlaveState to_message(const SlaveReport& report, std::size_t joint_count) {
  msg::SlaveState slave;
  slave.master_echo(dds::echo_of(report.followed));
  slave.state(static_cast<msg::LinkState>(report.outputs.state));
  slave.stop_cause(static_cast<msg::StopCause>(report.outputs.stop_cause));
  slave.joint_count(static_cast<std::uint32_t>(joint_count));
  slave.position_rad(report.position);
  slave.velocity_rad_s(report.velocity);
  slave.loop_torque_Nm(report.outputs.torque.loop_Nm);
  slave.external_torque_measured(report.force_measured);
  slave.external_torque_Nm(report.external_torque_Nm);
  slave.contact(report.contact);
  slave.contact_force_N(report.contact_force_N);
  slave.contact_object(report.contact_object);
  slave.contact_point_m().x(report.contact_point_W_m[0]);
  slave.contact_point_m().y(report.contact_point_W_m[1]);
  slave.contact_point_m().z(report.contact_point_W_m[2]);
  slave.tool_speed_m_s(report.tool_speed_m_s);
  slave.clearance_m(report.clearance_m);
  return slave;
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, std::size_t joints, Inbox& into)
      : joint_count(joints),
        inbox(into),
        participant("slave_io", network),
        stamper(participant),
        own_stamper(participant),
        status(participant),
        own_commands(participant, dds::kOperatorCommand),
        slave(participant, dds::kSlaveState),
        master(
            participant, dds::kMasterState,
            [this](const msg::MasterState& sample, const dds::SampleInfo& info) { on_master(sample, info); }),
        commands(participant, dds::kOperatorCommand,
                 [this](const msg::OperatorCommand& sample, const dds::SampleInfo&) { on_command(sample); }) {
  }

  void on_master(const msg::MasterState& sample, const dds::SampleInfo& info) {
    const char* reason = refusal(sample, joint_count);
    if (reason == nullptr) reason = dds::reason(source.judge(sample.stamp(), info.received_ns));
    if (reason == nullptr)
      return inbox.master.write(to_sample(sample, info.received_ns, participant.session()));
    master.count_refused();
    refusals.refused(in_words(reason, sample.joint_count()), info.received_ns);
  }

  std::string in_words(const char* reason, std::uint32_t joints) const {
    if (joints == joint_count) return reason;
    return std::string(reason) + " (it has " + std::to_string(joints) + " joints, this arm " +
           std::to_string(joint_count) + ")";
  }

  void on_command(const msg::OperatorCommand& sample) {
    if (!give_request(sample)) return commands.count_refused();
    if (sample.kind() == msg::COMMAND_EMERGENCY_STOP)
      spdlog::warn("emergency stop by {}", sample.issuer().to_string());
    if (sample.kind() == msg::COMMAND_RESET) spdlog::info("reset by {}", sample.issuer().to_string());
  }

  bool give_request(const msg::OperatorCommand& sample) {
    const std::lock_guard lock(mutex);
    if (!count_request(sample, requests)) return false;
    inbox.requests.write(requests);
    return true;
  }

  std::size_t joint_count;
  Inbox& inbox;
  std::mutex mutex;  // of requests
  teleop::StopRequests requests;
  dds::SourceGuard source;
  dds::RefusalLog refusals{"master_state"};
  dds::Participant participant;
  dds::Stamper stamper, own_stamper;
  dds::StatusReporter status;
  dds::Writer<msg::OperatorCommand> own_commands;
  dds::Writer<msg::SlaveState> slave;
  dds::Reader<msg::MasterState> master;
  dds::Reader<msg::OperatorCommand> commands;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, std::size_t joint_count, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, joint_count, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const SlaveReport& report) {
  msg::SlaveState sample = to_message(report, impl_->joint_count);
  sample.stamp(impl_->stamper.next());
  impl_->slave.write(sample);
}

void DdsAdapter::emergency_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  msg::OperatorCommand sample;
  sample.kind(msg::COMMAND_EMERGENCY_STOP);
  sample.issuer(issuer);
  sample.stamp(impl_->own_stamper.next());
  impl_->give_request(sample);
  impl_->own_commands.write(sample);
}

void DdsAdapter::publish_health(const core::Health& health) {
  const bool rival = impl_->source.has_rival(core::monotonic_ns());
  impl_->status.publish(rival ? dds::with_rival(health, "master_state") : health);
}

}  // namespace phantom::slave_io
