#include "components/slave_io/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/dds/endpoint.hpp"
#include "common/dds/operator_responder.hpp"
#include "common/dds/participant.hpp"
#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/robot/joint_values.hpp"
#include "components/slave_io/dds_adapter_convert.hpp"

namespace phantom::slave_io {

const char* refusal(const msg::MasterState& master, const Expectations& expected) noexcept {
  const std::size_t joint_count = expected.joint_count;
  if (master.stamp().sequence_number() == 0) return "it has no sequence number";
  if (master.joint_count() != joint_count) return "its joint count is not this arm's";
  if (!core::all_finite(master.position_rad(), joint_count)) return "a position is not a finite number";
  if (!core::all_finite(master.velocity_rad_s(), joint_count)) return "a velocity is not a finite number";
  if (master.state() > msg::LINK_STOPPED) return "its state is not known";
  for (std::size_t j = 0; j < joint_count; ++j) {
    if (!robot::near_limits(master.position_rad()[j], expected.lower[j], expected.upper[j]))
      return "a position is far outside of its joint's limits";
  }
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
          master.stop(),
          master.position_rad(),
          master.velocity_rad_s()};
}

msg::SlaveState to_message(const SlaveReport& report, std::size_t joint_count) {
  msg::SlaveState slave;
  slave.master_echo(dds::echo_of(report.followed));
  slave.state(static_cast<msg::LinkState>(report.outputs.state));
  slave.stop_cause(static_cast<msg::StopCause>(report.outputs.stop.cause));
  slave.stop(report.outputs.stop.id);
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
  Impl(const core::NetworkOptions& network, const Expectations& expectations, Inbox& into)
      : expected(expectations),
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
        responder(participant, core::Side::kSlave, inbox.stops) {}

  void on_master(const msg::MasterState& sample, const dds::SampleInfo& info) {
    const char* reason = refusal(sample, expected);
    if (reason == nullptr) reason = dds::reason(source.assess(sample.stamp(), info.received_ns));
    if (reason == nullptr)
      return inbox.master.write(to_sample(sample, info.received_ns, participant.session()));
    master.count_refused();
    refusals.refused(in_words(reason, sample.joint_count()), info.received_ns);
  }

  std::string in_words(const char* reason, std::uint32_t joints) const {
    if (joints == expected.joint_count) return reason;
    return std::string(reason) + " (it has " + std::to_string(joints) + " joints, this arm " +
           std::to_string(expected.joint_count) + ")";
  }

  Expectations expected;
  Inbox& inbox;
  dds::SourceGuard source;
  dds::RefusalLog refusals{"master_state"};
  dds::Participant participant;
  dds::Stamper stamper, own_stamper;
  dds::StatusReporter status;
  dds::Writer<msg::OperatorCommand> own_commands;
  dds::Writer<msg::SlaveState> slave;
  dds::Reader<msg::MasterState> master;
  dds::OperatorResponder responder;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, expectations, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const SlaveReport& report) {
  msg::SlaveState sample = to_message(report, impl_->expected.joint_count);
  sample.stamp(impl_->stamper.next());
  impl_->slave.write(sample);
  impl_->responder.on_report(report.stop_requests, report.outputs.stop.id != 0);
}

void DdsAdapter::announce_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  msg::OperatorCommand sample;
  sample.kind(msg::COMMAND_EMERGENCY_STOP);
  sample.issuer(issuer);
  sample.stamp(impl_->own_stamper.next());
  impl_->own_commands.write(sample);
}

void DdsAdapter::publish_health(const core::Health& health) {
  const bool rival = impl_->source.has_rival(core::monotonic_ns());
  impl_->status.publish(rival ? dds::with_rival(health, "master_state") : health);
}

}  // namespace phantom::slave_io
