#include "components/master_io/dds_adapter.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "common/dds/endpoint.hpp"
#include "common/dds/operator_responder.hpp"
#include "common/dds/participant.hpp"
#include "common/dds/refusal_log.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/robot/joint_values.hpp"
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
    if (!robot::near_limits(slave.position_rad()[j], expected.lower[j], expected.upper[j]))
      return "a position is far outside of its joint's limits";
  }
  return nullptr;
}

const char* refusal(const msg::DragField& field, const Expectations& expected) noexcept {
  if (field.stamp().sequence_number() == 0) return "it has no sequence number";
  const std::size_t count = expected.joint_count;
  if (field.joint_count() != count) return "its joint count is not the master's";
  const bool separable = expected.drag_mode == teleop::DragMode::kSeparable;
  if (field.mode() != (separable ? msg::DRAG_SEPARABLE : msg::DRAG_COUPLED)) {
    return separable
               ? "its law of drag is not separable, which this master renders (percept.mode); allowed: the "
                 "same mode in phantom_sensing.yaml and master_io.yaml"
               : "its law of drag is not coupled, which this master renders (percept.mode); allowed: the "
                 "same mode in phantom_sensing.yaml and master_io.yaml";
  }
  if (!non_negative(field.coefficient_plus(), count) || !non_negative(field.coefficient_minus(), count)) {
    return "a coefficient is negative or not a finite number";
  }
  if (separable) return nullptr;
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
  sample.stop = slave.stop();
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

core::Status take_setting(const msg::OperatorCommand& command, const GainRules& rules, double round_trip_s,
                          Settings& settings) {
  const double value = command.value();
  std::string why;
  switch (command.kind()) {
    case msg::COMMAND_SET_PERCEPT_GAIN:
      why = set_percept_gain(value, command.joint(), rules, settings);
      break;
    case msg::COMMAND_SET_FEEDBACK_GAIN:
      why = set_feedback_gain(value, command.joint(), rules, round_trip_s, settings);
      break;
    case msg::COMMAND_ENABLE_PERCEPT:
      if (value != 0.0 && value != 1.0)
        why = "percept is neither on nor off; allowed: 0 or 1";
      else
        settings.percept_enabled = value == 1.0;
      break;
    case msg::COMMAND_SET_LAW:
      why = set_law(value, settings);
      break;
    default:
      why = "this command is not for master_io";
  }
  return why.empty() ? core::Status::ok() : core::Status::invalid_argument(why);
}

msg::MasterState to_message(const MasterReport& report, std::size_t joint_count) {
  msg::MasterState master;
  const MasterOutputs& out = report.outputs;
  master.state(static_cast<msg::LinkState>(out.state));
  master.stop_cause(static_cast<msg::StopCause>(out.stop.cause));
  master.stop(out.stop.id);
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
  master.feedback_limited(out.feedback_limited);
  master.feedback_damped(out.feedback_damped);
  master.force_missing(out.force_missing);
  master.reach(report.reach);
  master.slave_echo(dds::echo_of(report.slave));
  master.drag_echo(dds::echo_of(report.drag));
  master.round_trip_s(report.round_trip_s);
  return master;
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const Expectations& expectations, const Settings& initial,
       Inbox& into)
      : expected(expectations),
        inbox(into),
        settings(initial),
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
        responder(participant, core::Side::kMaster, inbox.stops,
                  [this](const msg::OperatorCommand& sample) { return on_setting(sample); }) {
    inbox.settings.write(settings);
  }

  void on_slave(const msg::SlaveState& sample, core::Nanoseconds now_ns) {
    const char* reason = refusal(sample, expected);
    if (reason == nullptr) reason = dds::reason(slave_source.assess(sample.stamp(), now_ns));
    if (reason == nullptr) {
      slave_stop.store(sample.stop(), std::memory_order_relaxed);
      return inbox.slave.write(to_sample(sample, now_ns, participant.session()));
    }
    slave.count_refused();
    slave_refusals.refused(in_words(reason, sample.joint_count()), now_ns);
  }

  void on_field(const msg::DragField& sample, core::Nanoseconds now_ns) {
    const char* reason = refusal(sample, expected);
    if (reason == nullptr) reason = dds::reason(field_source.assess(sample.stamp(), now_ns));
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

  core::Status on_setting(const msg::OperatorCommand& sample) {
    const std::lock_guard lock(settings_mutex);
    const core::Status taken = take_setting(sample, expected.gains, feedback_delay_s, settings);
    if (taken.is_ok()) inbox.settings.write(settings);
    log_setting(sample, taken);
    return taken;
  }

  static void log_setting(const msg::OperatorCommand& sample, const core::Status& taken) {
    const std::string who = sample.issuer().to_string();
    if (!taken.is_ok()) return spdlog::warn("{} asked for what is refused: {}", who, taken.message());
    switch (sample.kind()) {
      case msg::COMMAND_SET_PERCEPT_GAIN:
        return spdlog::info("percept gain {} by {}", sample.value(), who);
      case msg::COMMAND_SET_FEEDBACK_GAIN:
        return spdlog::info("feedback gain {} by {}", sample.value(), who);
      case msg::COMMAND_SET_LAW:
        return spdlog::info("law {} by {}",
                            teleop::name_of(static_cast<teleop::BilateralLaw>(sample.value())), who);
      default:
        return spdlog::info("percept {} by {}", sample.value() != 0.0 ? "on" : "off", who);
    }
  }

  // What this process asks of the others; its own part is done already.
  void announce(msg::CommandKind kind, const std::string& issuer, const core::StopReset& names = {}) {
    msg::OperatorCommand sample;
    sample.kind(kind);
    sample.joint(-1);
    sample.master_stop(names.own);
    sample.slave_stop(names.partner);
    sample.issuer(issuer);
    const std::lock_guard lock(own_mutex);
    sample.stamp(own_stamper.next());
    own_commands.write(sample);
  }

  Expectations expected;
  Inbox& inbox;
  std::mutex settings_mutex, own_mutex;
  Settings settings;
  std::atomic<teleop::StopId> stop_in_force{0}, slave_stop{0};
  std::atomic<double> feedback_delay_s{0.0};  // in force in the servo
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
  dds::OperatorResponder responder;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations,
                       const Settings& settings, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, expectations, settings, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const MasterReport& report) {
  impl_->feedback_delay_s = report.outputs.feedback_delay_s;
  msg::MasterState sample = to_message(report, impl_->expected.joint_count);
  sample.stamp(impl_->stamper.next());
  impl_->master.write(sample);
  impl_->responder.on_report(report.stop_requests, report.outputs.stop.id != 0);
  impl_->stop_in_force.store(report.outputs.stop.id, std::memory_order_relaxed);
}

void DdsAdapter::emergency_stop(const std::string& issuer) {
  impl_->inbox.stops.stop();
  announce_stop(issuer);
}

void DdsAdapter::announce_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  impl_->announce(msg::COMMAND_EMERGENCY_STOP, issuer);
}

void DdsAdapter::reset(const std::string& issuer) {
  const core::StopReset names{impl_->stop_in_force.load(std::memory_order_relaxed),
                              impl_->slave_stop.load(std::memory_order_relaxed)};
  spdlog::info("reset by {}", issuer);
  impl_->inbox.stops.reset(names);
  impl_->announce(msg::COMMAND_RESET, issuer, names);
}

void DdsAdapter::publish_health(const core::Health& health) {
  const char* topic = impl_->topic_with_rival();
  impl_->status.publish(topic != nullptr ? dds::with_rival(health, topic) : health);
}

core::DurationHistogram DdsAdapter::round_trips() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->round_trips;
}

}  // namespace phantom::master_io
