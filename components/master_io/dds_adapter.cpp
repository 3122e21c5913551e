#include "components/master_io/dds_adapter.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <mutex>
#include <utility>

#include "common/dds/endpoints/participant.hpp"
#include "common/messages/clock_report.hpp"
#include "common/messages/codecs/haptic_device_codec.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/operator_responder.hpp"
#include "common/messages/publisher.hpp"
#include "common/messages/request_log.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/teleop/gripper/grip_lead.hpp"
#include "components/master_io/dds_adapter_convert.hpp"

namespace phantom::master_io {

std::string refusal(const messages::DragField& field, teleop::DragMode rendered) {
  if (field.mode == rendered) return "";
  return std::string("its law of drag is not ") +
         (rendered == teleop::DragMode::kSeparable ? "separable" : "coupled") +
         ", which this master renders (percept.mode); "
         "allowed: the same mode in phantom_sensing.yaml and master_io.yaml";
}

Vicinity vicinity_of(const messages::Percept& percept, core::Nanoseconds received_ns) noexcept {
  if (!percept.valid) return {.received_ns = received_ns};
  return {received_ns, percept.greatest_closeness >= 1.0, percept.closeness,
          percept.threats.empty() ? 0.0 : percept.threats[0].closeness};
}

double RoundTrip::measure(const messages::DragField& field, core::Nanoseconds received_ns) noexcept {
  const core::SampleId& echo = field.master_echo;
  const core::Nanoseconds made_ns = core::answered_ns(echo, session_, received_ns);
  if (made_ns == 0 || echo.sequence_number <= last_) return -1.0;
  last_ = echo.sequence_number;
  return core::seconds(received_ns - made_ns);
}

std::string refusal(const messages::HapticDevice& device, const HapticNeeds& needs) {
  const auto& able = device.able;
  const auto why = [](const char* what, double has, const char* key, double wanted, const char* allowed) {
    return fmt::format("its {} is {:g}, cartesian.{} {:g}; allowed: {}", what, has, key, wanted, allowed);
  };
  constexpr std::uint32_t kAbout = messages::kAllAxes & ~messages::kPositionAxes;
  if (able.mass_kg < needs.mass_kg) return why("mass_kg", able.mass_kg, "mass_kg", needs.mass_kg, "no more");
  if (able.inertia_kg_m2 < needs.inertia_kg_m2)
    return why("inertia_kg_m2", able.inertia_kg_m2, "inertia_kg_m2", needs.inertia_kg_m2, "no more");
  if ((able.actuated_axes & messages::kPositionAxes) != 0 && able.max_force_N < needs.force_N)
    return why("max_force_N", able.max_force_N, "force_limit_N", needs.force_N, "no more");
  if ((able.actuated_axes & kAbout) != 0 && able.max_moment_N_m < needs.moment_N_m)
    return why("max_moment_N_m", able.max_moment_N_m, "moment_limit_N_m", needs.moment_N_m, "no more");
  if (needs.orientation && able.measured_axes != messages::kAllAxes)
    return "it does not measure its orientation; allowed: cartesian.orientation: false";
  return "";
}

SeenView seen(const messages::ViewPose& view, core::Nanoseconds received_ns) noexcept {
  SeenView result{received_ns, {}};
  Eigen::Map<Eigen::Matrix3d>(result.R_WC.data()) = view.X_WC.rotation;
  return result;
}

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const Expectations& expectations, const Settings& initial,
       Inbox& into)
      : expected(expectations),
        inbox(into),
        settings(initial),
        participant("master_io", network),
        round_trip(participant.session()),
        status(participant),
        master(participant, dds::kMasterState),
        slave(participant, dds::kSlaveState, {expected.arm, {.other_model = messages::OtherModel::kMarked}},
              [this](const messages::Received<messages::SlaveState>& state) {
                slave_stop.store(state.stop.id, std::memory_order_relaxed);
                SlaveSample sample(state, state.master_echo, state.received_ns, participant.session());
                sample.other_model = slave.of_other_model();
                inbox.slave.write(sample);
              }),
        field(participant, dds::kDragField,
              {expected.arm,
               {.refusal = [mode = expected.drag_mode](
                               const messages::DragField& sample) { return refusal(sample, mode); }}},
              [this](const messages::Received<messages::DragField>& sample) { on_field(sample); }),
        percept(participant, dds::kPercept, expected.arm,
                [this](const messages::Received<messages::Percept>& sample) {
                  inbox.phantom.write(vicinity_of(sample, sample.received_ns));
                }),
        view(participant, dds::kViewPose, {},
             [this](const messages::Received<messages::ViewPose>& sample) {
               inbox.view.write(seen(sample, sample.received_ns));
             }),
        haptic_stamper(participant),
        wrench(participant, dds::kHapticDeviceWrench),
        haptic(participant, dds::kHapticDevice,
               {messages::ArmBounds(),
                {.refusal =
                     [needs = expected.haptic](const messages::HapticDevice& sample) {
                       return needs
                                  ? refusal(sample, *needs)
                                  : "no haptic device is used here; allowed: cartesian.input: haptic_device";
                     }}},
               [this](const messages::Received<messages::HapticDevice>& sample) {
                 grip_opening.store(sample.grip_opening, std::memory_order_relaxed);
                 inbox.haptic.write({sample, sample.wrench_echo, sample.received_ns, participant.session()});
               }),
        responder(participant, teleop::Side::kMaster, inbox.stops,
                  [this](const messages::OperatorCommand& command) { return on_setting(command); }) {
    inbox.settings.write(settings);
    if (!expected.haptic) return;
    gripper.emplace(participant, dds::kGripperState, expected.arm,
                    [this](const messages::Received<messages::GripperState>& state) {
                      grippers.write({state, state.widest_m});
                    });
  }

  void on_field(const messages::Received<messages::DragField>& sample) {
    DragSample drag(sample, sample.master_echo, sample.received_ns, participant.session());
    drag.round_trip_s = round_trip.measure(sample, sample.received_ns);
    if (drag.round_trip_s >= 0.0) {
      const std::lock_guard lock(mutex);
      round_trips.record(core::from_seconds(drag.round_trip_s));
    }
    inbox.drag.write(drag);
  }

  const char* topic_with_rival() const {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    return slave.source().has_rival(now_ns)    ? "slave_state"
           : field.source().has_rival(now_ns)  ? "drag_field"
           : haptic.source().has_rival(now_ns) ? "haptic_device"
                                               : nullptr;
  }

  // The stamp has the tick's time, to which the device's echo is compared: it counts the wait for this
  // thread, too.
  void publish(const messages::HapticDeviceWrench& sample) {
    msg::HapticDeviceWrench message = to_idl(sample);
    msg::Stamp stamp = haptic_stamper.next();
    stamp.monotonic_ns(sample.stamp.monotonic_ns);
    message.stamp(stamp);
    wrench.write(message);
  }

  // Requests what the device's grip wants of the slave's gripper. Called by the publishing thread.
  void lead_gripper(bool may) {
    constexpr core::Nanoseconds kQuiet_ns = 10 * core::kNsPerSecond;
    const core::Nanoseconds now_ns = core::monotonic_ns();
    grippers.read(newest_gripper);
    const bool led = grip.leads();
    const double opening = grip_opening.load(std::memory_order_relaxed);
    const auto width_m = grip.step(opening, may, newest_gripper, now_ns);
    if (grip.leads() && !led && now_ns >= grip_quiet_until_ns) {
      grip_quiet_until_ns = now_ns + kQuiet_ns;
      spdlog::info("the haptic device's grip leads the gripper");
    }
    if (width_m) request_gripper(*width_m, "haptic device");
  }

  void request_gripper(double width_m, const std::string& issuer) {
    responder.announce({.kind = teleop::CommandKind::kGripperWidth, .value = width_m, .issuer = issuer});
  }

  core::Status on_setting(const messages::OperatorCommand& command) {
    const std::lock_guard lock(settings_mutex);
    return apply(command);
  }

  void choose_percepts(PerceptKey key, const std::string& issuer) {
    const std::lock_guard lock(settings_mutex);
    const int number = percepts_by_key(settings.percepts, key);
    static_cast<void>(apply(
        {.kind = teleop::CommandKind::kSetPercepts, .value = static_cast<double>(number), .issuer = issuer}));
  }

  // With settings_mutex held.
  core::Status apply(const messages::OperatorCommand& command) {
    const core::Status applied = apply_setting(command, expected.gains, feedback_delay_s, settings);
    if (applied) inbox.settings.write(settings);
    if (!messages::is_logged(settings_rate, "settings")) return applied;
    if (!applied) {
      spdlog::warn("{} asked for what is refused: {}", command.issuer, applied.message());
    } else if (command.kind == teleop::CommandKind::kSetLaw) {
      spdlog::info("law {} by {}", teleop::name_of(settings.law), command.issuer);
    } else {
      spdlog::info("{} {} by {}", teleop::rule_of(command.kind).name, command.value, command.issuer);
    }
    return applied;
  }

  Expectations expected;
  Inbox& inbox;
  std::mutex settings_mutex;
  Settings settings;
  core::LogRate settings_rate;  // guarded by settings_mutex, as settings
  std::atomic<teleop::StopId> stop_in_force{0}, slave_stop{0};
  std::uint32_t gripper_asked = 0;            // of the simulated operator's requests, those passed on
  std::atomic<double> feedback_delay_s{0.0};  // delay in force in the servo
  std::atomic<double> grip_opening{-1.0};     // of the haptic device
  core::Snapshot<teleop::GripLead::Gripper> grippers;
  teleop::GripLead::Gripper newest_gripper;  // this and what follows: the publishing thread's
  teleop::GripLead grip;
  core::Nanoseconds grip_quiet_until_ns = 0;
  std::mutex mutex;  // guards round_trips
  core::DurationHistogram round_trips;
  dds::Participant participant;
  RoundTrip round_trip;
  messages::StatusReporter status;
  messages::Publisher<messages::MasterState> master;
  messages::TopicSubscriber<msg::SlaveState> slave;
  messages::TopicSubscriber<msg::DragField> field;
  messages::ClockReport slave_clock{"slave_io"}, field_clock{"phantom_sensing"};
  messages::TopicSubscriber<msg::Percept> percept;
  messages::TopicSubscriber<msg::ViewPose> view;
  dds::Stamper haptic_stamper;
  dds::Writer<msg::HapticDeviceWrench> wrench;
  messages::TopicSubscriber<msg::HapticDevice> haptic;
  std::optional<messages::TopicSubscriber<msg::GripperState>> gripper;  // for a device with a grip
  messages::OperatorResponder responder;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const Expectations& expectations,
                       const Settings& settings, Inbox& inbox)
    : impl_(std::make_unique<Impl>(network, expectations, settings, inbox)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish(const MasterReport& report) {
  impl_->feedback_delay_s = report.outputs.feedback_delay_s;
  if (report.has_wrench) {
    impl_->publish(report.wrench);
    impl_->lead_gripper(report.wrench.valid && report.outputs.state == teleop::LinkState::kCoupled);
  }
  impl_->master.publish(report);
  impl_->responder.on_report(report.stop_requests, report.outputs.stop.id != 0);
  impl_->stop_in_force.store(report.outputs.stop.id, std::memory_order_relaxed);
  if (std::exchange(impl_->gripper_asked, report.gripper_asked) != report.gripper_asked)
    ask_gripper(report.gripper_open ? 1.0 : 0.0, "simulated operator");
}

void DdsAdapter::emergency_stop(const std::string& issuer) {
  impl_->inbox.stops.stop();
  announce_stop(issuer);
}

void DdsAdapter::announce_stop(const std::string& issuer) {
  spdlog::warn("emergency stop by {}", issuer);
  impl_->responder.announce({.kind = teleop::CommandKind::kEmergencyStop, .issuer = issuer});
}

void DdsAdapter::reset(const std::string& issuer) {
  const teleop::StopReset names{impl_->stop_in_force.load(std::memory_order_relaxed),
                                impl_->slave_stop.load(std::memory_order_relaxed)};
  spdlog::info("reset by {}", issuer);
  impl_->inbox.stops.reset(names);
  impl_->responder.announce({.kind = teleop::CommandKind::kReset,
                             .master_stop = names.own,
                             .slave_stop = names.partner,
                             .issuer = issuer});
}

void DdsAdapter::ask_gripper(double width_m, const std::string& issuer) {
  spdlog::info("gripper {} by {}", width_m > 0.0 ? "open" : "closed", issuer);
  impl_->request_gripper(width_m, issuer);
}

void DdsAdapter::choose_percepts(PerceptKey key, const std::string& issuer) {
  impl_->choose_percepts(key, issuer);
}

void DdsAdapter::publish_health(const core::Health& health) {
  const char* topic = impl_->topic_with_rival();
  core::Health shown = topic != nullptr ? dds::with_rival(health, topic) : health;
  const core::Nanoseconds now_ns = core::monotonic_ns();
  messages::add_difference(shown, impl_->slave.model_difference());
  messages::add_difference(shown, impl_->field.model_difference());
  impl_->slave_clock.add_to(shown, impl_->slave.clock_difference_s(), now_ns);
  impl_->field_clock.add_to(shown, impl_->field.clock_difference_s(), now_ns);
  impl_->status.publish(shown);
}

core::DurationHistogram DdsAdapter::round_trips() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->round_trips;
}

}  // namespace phantom::master_io
