#include "components/master_io/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>

#include "common/dds/operator_responder.hpp"
#include "common/dds/participant.hpp"
#include "common/dds/stamp.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "components/master_io/dds_adapter_convert.hpp"

namespace phantom::master_io {

std::string refusal(const messages::DragField& field, teleop::DragMode rendered) {
  if (field.mode == rendered) return "";
  return std::string("its law of drag is not ") +
         (rendered == teleop::DragMode::kSeparable ? "separable" : "coupled") +
         ", which this master renders (percept.mode); "
         "allowed: the same mode in phantom_sensing.yaml and master_io.yaml";
}

PhantomContact contact_of(const messages::Percept& percept, core::Nanoseconds received_ns) noexcept {
  return {received_ns, percept.valid && percept.closeness >= 1.0};
}

double RoundTrip::measure(const messages::DragField& field, core::Nanoseconds received_ns) noexcept {
  const core::SampleId& echo = field.master_echo;
  const core::Nanoseconds made_ns = core::answered_ns(echo, session_, received_ns);
  if (made_ns == 0 || echo.sequence_number <= last_) return -1.0;
  last_ = echo.sequence_number;
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
        slave(participant, dds::kSlaveState, expected.arm,
              [this](const messages::SlaveState& state, core::Nanoseconds received_ns) {
                slave_stop.store(state.stop.id, std::memory_order_relaxed);
                inbox.slave.write({state, state.master_echo, received_ns, participant.session()});
              }),
        field(
            participant, dds::kDragField, expected.arm,
            [this](const messages::DragField& sample, core::Nanoseconds received_ns) {
              on_field(sample, received_ns);
            },
            [mode = expected.drag_mode](const messages::DragField& sample) { return refusal(sample, mode); }),
        percept(participant, dds::kPercept, expected.arm,
                [this](const messages::Percept& sample, core::Nanoseconds received_ns) {
                  inbox.phantom.write(contact_of(sample, received_ns));
                }),
        responder(participant, core::Side::kMaster, inbox.stops,
                  [this](const msg::OperatorCommand& sample) { return on_setting(sample); }) {
    inbox.settings.write(settings);
  }

  void on_field(const messages::DragField& sample, core::Nanoseconds now_ns) {
    DragSample drag(sample, sample.master_echo, now_ns, participant.session());
    drag.round_trip_s = round_trip.measure(sample, now_ns);
    if (drag.round_trip_s >= 0.0) {
      const std::lock_guard lock(mutex);
      round_trips.record(core::from_seconds(drag.round_trip_s));
    }
    inbox.drag.write(drag);
  }

  const char* topic_with_rival() const {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    return slave.has_rival(now_ns) ? "slave_state" : field.has_rival(now_ns) ? "drag_field" : nullptr;
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

  // Publishes what this process requests of the others; it has applied its own part already.
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
  std::atomic<double> feedback_delay_s{0.0};  // delay in force in the servo
  std::mutex mutex;                           // guards round_trips
  core::DurationHistogram round_trips;
  dds::Participant participant;
  RoundTrip round_trip;
  dds::Stamper stamper, own_stamper;
  dds::StatusReporter status;
  dds::Writer<msg::MasterState> master;
  dds::Writer<msg::OperatorCommand> own_commands;
  messages::CheckedReader<msg::SlaveState> slave;
  messages::CheckedReader<msg::DragField> field;
  messages::CheckedReader<msg::Percept> percept;
  dds::OperatorResponder responder;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations,
                       const Settings& settings, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, expectations, settings, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const MasterReport& report) {
  impl_->feedback_delay_s = report.outputs.feedback_delay_s;
  msg::MasterState sample = messages::to_idl(report);
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
