#include "components/master_io/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>

#include "common/dds/endpoint.hpp"
#include "common/dds/participant.hpp"
#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "components/master_io/dds_adapter_convert.hpp"

namespace phantom::master_io {
namespace {

bool non_negative(const core::JointArray& values, std::size_t count) noexcept {
  return core::all_finite(values, count) &&
         std::all_of(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count),
                     [](double v) { return v >= 0.0; });
}

}  // namespace

const char* refusal(const msg::SlaveState& slave, const Expectations& expected) noexcept {
  if (slave.stamp().sequence_number() == 0) return "it has no sequence number";
  if (slave.joint_count() != expected.joint_count) return "its joint count is not the master's";
  if (!core::all_finite(slave.position_rad(), expected.joint_count))
    return "a position is not a finite number";
  if (!core::all_finite(slave.velocity_rad_s(), expected.joint_count))
    return "a velocity is not a finite number";
  if (!core::all_finite(slave.loop_torque_Nm(), expected.joint_count))
    return "a loop torque is not a finite number";
  if (!core::all_finite(slave.external_torque_Nm(), expected.joint_count))
    return "an external torque is not a finite number";
  if (!std::isfinite(slave.tool_speed_m_s()) || !std::isfinite(slave.clearance_m())) {
    return "its tool speed or clearance is not a finite number";
  }
  if (slave.state() > msg::LINK_STOPPED) return "its state is not known";
  for (std::size_t j = 0; j < expected.joint_count; ++j) {
    const double margin = 0.05 * (expected.upper[j] - expected.lower[j]);
    const double q = slave.position_rad()[j];
    if (q < expected.lower[j] - margin || q > expected.upper[j] + margin)
      return "a position is far outside of its joint's limits";
  }
  return nullptr;
}

const char* refusal(const msg::DragField& field, const Expectations& expected) noexcept {
  if (field.stamp().sequence_number() == 0) return "it has no sequence number";
  const std::size_t count = expected.joint_count;
  if (field.joint_count() != count) return "its joint count is not the master's";
  if (expected.drag_mode == teleop::DragMode::kSeparable) {
    if (!non_negative(field.coefficient_plus(), count) || !non_negative(field.coefficient_minus(), count)) {
      return "a coefficient is negative or not a finite number";
    }
    return nullptr;
  }
  for (std::size_t k = 0; k < count * (count + 1) / 2; ++k) {
    if (!std::isfinite(field.coupled()[k])) return "an entry of the drag matrix is not a finite number";
  }
  return nullptr;
}

SlaveSample to_sample(const msg::SlaveState& slave, core::Nanoseconds received_ns,
                      std::uint64_t own_session) noexcept {
  SlaveSample sample;
  sample.received_ns = received_ns;
  sample.stamp = dds::id_of(slave.stamp());
  sample.answers_ns = dds::answered_ns(slave.master_echo(), own_session, received_ns);
  sample.answers_another = slave.master_echo().session() != 0 && slave.master_echo().session() != own_session;
  sample.state = static_cast<teleop::LinkState>(slave.state());
  sample.motion = {slave.position_rad(), slave.velocity_rad_s()};
  sample.effort = {slave.loop_torque_Nm(), slave.external_torque_Nm()};
  sample.force_measured = slave.external_torque_measured();
  sample.contact = slave.contact();
  sample.contact_object = slave.contact_object();
  sample.tool_speed_m_s = slave.tool_speed_m_s();
  sample.clearance_m = slave.clearance_m();
  return sample;
}

DragSample to_sample(const msg::DragField& field, core::Nanoseconds received_ns,
                     std::uint64_t own_session) noexcept {
  DragSample sample;
  sample.received_ns = received_ns;
  sample.stamp = dds::id_of(field.stamp());
  sample.answers_ns = dds::answered_ns(field.master_echo(), own_session, received_ns);
  sample.drag.valid = field.valid();
  sample.drag.plus = field.coefficient_plus();
  sample.drag.minus = field.coefficient_minus();
  sample.drag.coupled = field.coupled();
  return sample;
}

PhantomContact to_sample(const msg::Percept& percept, core::Nanoseconds received_ns) noexcept {
  return {received_ns, percept.valid() && percept.closeness() >= 1.0};
}

double RoundTrip::measure(const msg::DragField& field, core::Nanoseconds received_ns) noexcept {
  const msg::Echo& echo = field.master_echo();
  const core::Nanoseconds made_ns = dds::answered_ns(echo, session_, received_ns);
  if (made_ns == 0 || echo.sequence_number() <= last_) return -1.0;
  last_ = echo.sequence_number();
  return core::seconds(received_ns - made_ns);
}

bool take_wish(const msg::OperatorCommand& command, Wishes& wishes) noexcept {
  const double value = command.value();
  if (command.stamp().sequence_number() == 0) return false;
  switch (command.kind()) {
    case msg::COMMAND_EMERGENCY_STOP:
      wishes.requests.stop();
      return true;
    case msg::COMMAND_RESET:
      wishes.requests.reset();
      return true;
    case msg::COMMAND_SET_PERCEPT_GAIN:
      if (!(value >= 0.0 && value <= 1000.0)) return false;
      wishes.percept_gain = value;
      return true;
    case msg::COMMAND_SET_FEEDBACK_GAIN:
      if (!(value >= 0.0 && value <= 10.0)) return false;
      wishes.feedback_gain = value;
      return true;
    case msg::COMMAND_ENABLE_PERCEPT:
      if (value != 0.0 && value != 1.0) return false;
      wishes.percept_enabled = value == 1.0;
      return true;
    case msg::COMMAND_SET_LAW:
      if (!(value >= 0.0 && value < teleop::kBilateralLaws && value == std::floor(value))) return false;
      wishes.law = static_cast<teleop::BilateralLaw>(value);
      wishes.feedback_gain = teleop::kLawsOwnGain;  // a gain that suits one law can be unstable in another
      return true;
    case msg::COMMAND_VIEW_HOLD:
    case msg::COMMAND_VIEW_NODE:
    case msg::COMMAND_MARK:
      return true;
  }
  return false;
}

msg::MasterState to_message(const MasterReport& report, std::size_t joint_count) {
  msg::MasterState master;
  const MasterOutputs& out = report.outputs;
  master.state(static_cast<msg::LinkState>(out.state));
  master.stop_cause(static_cast<msg::StopCause>(out.stop_cause));
  master.law(static_cast<msg::BilateralLaw>(out.law));
  master.joint_count(static_cast<std::uint32_t>(joint_count));
  master.position_rad(report.position);
  master.velocity_rad_s(report.velocity);
  master.percept_torque_Nm(out.percept_Nm);
  master.feedback_torque_Nm(out.feedback_Nm);
  master.operator_torque_Nm(report.operator_Nm);
  master.percept_gain(out.percept_gain);
  master.feedback_gain(out.feedback_gain);
  master.percept_enabled(out.percept_enabled);
  master.percept_limited(out.damping_limited || out.torque_limited);
  master.feedback_damped(out.feedback_damped);
  master.force_missing(out.force_missing);
  master.reach(report.reach);
  master.slave_echo(dds::echo_of(report.slave));
  master.drag_echo(dds::echo_of(report.drag));
  master.round_trip_s(report.round_trip_s);
  return master;
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const Expectations& expectations, const Wishes& initial,
       Inbox& into)
      : expected(expectations),
        inbox(into),
        wishes(initial),
        participant("master_io", network),
        round_trip(participant.session()),
        stamper(participant),
        own_stamper(participant),
        status(participant),
        master(participant, dds::kMasterState),
        own_commands(participant, dds::kOperatorCommand),
        slave(participant, dds::kSlaveState,
              [this](const msg::SlaveState& sample, const dds::SampleInfo& info) {
                on_slave(sample, info.received_ns);
              }),
        field(participant, dds::kDragField,
              [this](const msg::DragField& sample, const dds::SampleInfo& info) {
                on_field(sample, info.received_ns);
              }),
        percept(participant, dds::kPercept,
                [this](const msg::Percept& sample, const dds::SampleInfo& info) {
                  if (percept_order.accept(sample.stamp()))
                    inbox.phantom.write(to_sample(sample, info.received_ns));
                }),
        commands(participant, dds::kOperatorCommand,
                 [this](const msg::OperatorCommand& sample, const dds::SampleInfo&) { on_command(sample); }) {
    inbox.wishes.write(wishes);
  }

  void on_slave(const msg::SlaveState& sample, core::Nanoseconds now_ns) {
    const char* reason = refusal(sample, expected);
    if (reason == nullptr) reason = dds::reason(slave_source.judge(sample.stamp(), now_ns));
    if (reason == nullptr) return inbox.slave.write(to_sample(sample, now_ns, participant.session()));
    slave.count_refused();
    slave_refusals.refused(in_words(reason, sample.joint_count()), now_ns);
  }

  void on_field(const msg::DragField& sample, core::Nanoseconds now_ns) {
    const char* reason = refusal(sample, expected);
    if (reason == nullptr) reason = dds::reason(field_source.judge(sample.stamp(), now_ns));
    if (reason != nullptr) {
      field.count_refused();
      return field_refusals.refused(in_words(reason, sample.joint_count()), now_ns);
    }
    DragSample drag = to_sample(sample, now_ns, participant.session());
    drag.round_trip_s = round_trip.measure(sample, now_ns);
    if (drag.round_trip_s >= 0.0) {
      const std::lock_guard lock(mutex);
      round_trips.record(core::from_seconds(drag.round_trip_s));
    }
    inbox.drag.write(drag);
  }

  std::string in_words(const char* reason, std::uint32_t joints) const {
    if (joints == expected.joint_count) return reason;
    return std::string(reason) + " (it has " + std::to_string(joints) + " joints, the master " +
           std::to_string(expected.joint_count) + ")";
  }
  const char* topic_with_rival() const {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    return slave_source.has_rival(now_ns)   ? "slave_state"
           : field_source.has_rival(now_ns) ? "drag_field"
                                            : nullptr;
  }

  void on_command(const msg::OperatorCommand& sample) {
    if (!give_wish(sample)) return commands.count_refused();
    const std::string who = sample.issuer().to_string();
    switch (sample.kind()) {
      case msg::COMMAND_EMERGENCY_STOP:
        return spdlog::warn("emergency stop by {}", who);
      case msg::COMMAND_RESET:
        return spdlog::info("reset by {}", who);
      case msg::COMMAND_SET_PERCEPT_GAIN:
        return spdlog::info("percept gain {} asked for by {}", sample.value(), who);
      case msg::COMMAND_SET_FEEDBACK_GAIN:
        return spdlog::info("feedback gain {} asked for by {}", sample.value(), who);
      case msg::COMMAND_SET_LAW:
        return spdlog::info("law {} asked for by {}",
                            teleop::name_of(static_cast<teleop::BilateralLaw>(sample.value())), who);
      case msg::COMMAND_ENABLE_PERCEPT:
        return spdlog::info("percept {} by {}", sample.value() != 0.0 ? "on" : "off", who);
      default:
        return;
    }
  }

  // The wish takes effect here; what the topic brings back to us of our own commands does no harm.
  bool give_wish(const msg::OperatorCommand& sample) {
    const std::lock_guard lock(wishes_mutex);
    if (!take_wish(sample, wishes)) return false;
    inbox.wishes.write(wishes);
    return true;
  }

  void command(msg::CommandKind kind, const std::string& issuer) {
    msg::OperatorCommand sample;
    sample.kind(kind);
    sample.issuer(issuer);
    const std::lock_guard lock(own_mutex);
    sample.stamp(own_stamper.next());
    give_wish(sample);
    own_commands.write(sample);
  }

  Expectations expected;
  Inbox& inbox;
  std::mutex wishes_mutex, own_mutex;
  Wishes wishes;
  dds::SequenceGuard percept_order;
  dds::SourceGuard slave_source, field_source;
  dds::RefusalLog slave_refusals{"slave_state"}, field_refusals{"drag_field"};
  std::mutex mutex;  // of the next
  core::DurationHistogram round_trips;
  dds::Participant participant;
  RoundTrip round_trip;
  dds::Stamper stamper, own_stamper;
  dds::StatusReporter status;
  dds::Writer<msg::MasterState> master;
  dds::Writer<msg::OperatorCommand> own_commands;
  dds::Reader<msg::SlaveState> slave;
  dds::Reader<msg::DragField> field;
  dds::Reader<msg::Percept> percept;
  dds::Reader<msg::OperatorCommand> commands;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations,
                       const Wishes& wishes, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, expectations, wishes, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const MasterReport& report) {
  msg::MasterState sample = to_message(report, impl_->expected.joint_count);
  sample.stamp(impl_->stamper.next());
  impl_->master.write(sample);
}

void DdsAdapter::emergency_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  impl_->command(msg::COMMAND_EMERGENCY_STOP, issuer);
}

void DdsAdapter::reset(const std::string& issuer) { impl_->command(msg::COMMAND_RESET, issuer); }

void DdsAdapter::publish_health(const core::Health& health) {
  const char* topic = impl_->topic_with_rival();
  impl_->status.publish(topic != nullptr ? dds::with_rival(health, topic) : health);
}

core::DurationHistogram DdsAdapter::round_trips() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->round_trips;
}

}  // namespace phantom::master_io
