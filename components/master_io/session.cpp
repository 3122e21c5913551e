#include "components/master_io/session.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <tuple>

#include "common/core/errors.hpp"
#include "common/core/random.hpp"
#include "common/core/text.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_identity.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/servo/servo_session.hpp"
#include "common/runtime/servo/switch_input.hpp"
#include "common/teleop/rendering/percept_set.hpp"
#include "components/master_io/dds_adapter.hpp"
#include "components/master_io/devices/cartesian_device.hpp"
#include "components/master_io/devices/desk_input.hpp"
#include "components/master_io/devices/haptic_device.hpp"
#include "components/master_io/devices/mapped_device.hpp"
#include "components/master_io/report.hpp"
#include "components/master_io/servo.hpp"

namespace phantom::master_io {
namespace {

using teleop::LinkState;

constexpr core::Nanoseconds kAnnounceEvery_ns = 30 * core::kNsPerSecond;

std::string masking_sentence(const MasterReport& now) {
  using enum teleop::BilateralLaw;
  if (now.law == kPe || now.law == kPeff) return "the slave's lag masks the drag: rely on tone and views";
  if (now.law == kSctfb && now.outputs.counterbalance == teleop::Counterbalance::kNone)
    return "the arm's weight masks the drag: lower 1/A, counterbalance the arm, or rely on tone and views";
  return "the slave's feedback masks the drag: lower 1/A, or raise G";
}

}  // namespace

std::string sentence(const MasterReport& now) {
  const MasterOutputs& own = now.outputs;
  if (teleop::waits_for_switch(own)) return teleop::switch_sentence(own, "slave");
  switch (now.state) {
    case LinkState::kInit:
      if (own.peer_has_other_model) return "the slave works with another arm or cell: waiting";
      return own.peer_bound_elsewhere ? "the slave answers another master_io: waiting"
                                      : "waiting for the slave";
    case LinkState::kReady:
      return own.slave_touches ? "the slave touches something and may not come: bring the master to its pose"
                               : "waiting for the slave to come to the master's pose";
    case LinkState::kDegraded:
      if (own.peer_has_other_model) return "the slave works with another arm or cell: torques off";
      return own.peer_bound_elsewhere ? "the slave answers another master_io: torques off"
                                      : "slave lost or holding: torques off";
    case LinkState::kStopped:
      return std::string(name_of(now.stop.cause)) + ": torques off until reset" +
             (own.partner_unconfirmed ? "; THE SLAVE HAS NOT CONFIRMED THAT IT IS STOPPED" : "");
    default:
      if (now.force_missing) {
        return fmt::format("law {} needs a force sensor, which the slave does not have: no feedback",
                           teleop::name_of(now.law));
      }
      if (now.feedback_limited) {
        // No figures: they change all the time, and each change would report the sentence again.
        return "1/A is held at what is stable with the link's delay";
      }
      if (now.feedback_damped)
        return "slave feedback damped: it returned more energy than the operator put in";
      if (own.damping_limited) return "the percept is limited to what the master renders stably";
      return own.drag_masked ? masking_sentence(now) : "";
  }
}

namespace {

std::string row_of_table(const MasterReport& now) {
  const auto set = teleop::percept_set(now.law, now.outputs.counterbalance);
  return fmt::format("{}: {}{}; Table 6.1: drag {}, tone {}, views {} ({})", set.row,
                     teleop::words_of(now.outputs.percepts),
                     now.outputs.percepts.automatic ? ", as the law has them" : "", name_of(set.haptic),
                     name_of(set.audio), name_of(set.view), set.reason);
}

/// Logs changes of law, percepts and counterbalancing, and a percept or feedback that is reduced for
/// stability.
class EventLogger {
 public:
  void look(const MasterReport& now, core::Nanoseconds now_ns) {
    // Before the slave is heard, nobody knows what carries its weight.
    const Row row{now.law, now.outputs.counterbalance, now.outputs.percepts};
    if (now.state != LinkState::kInit && row != row_) {
      row_ = row;
      spdlog::info(row_of_table(now));
    }
    if (now.feedback_damped && now_ns >= damped_quiet_until_ns_) {
      damped_quiet_until_ns_ = now_ns + kAnnounceEvery_ns;
      spdlog::info("the slave's feedback gave more energy than it took: damped");
    }
    if (!now.outputs.damping_limited || now_ns < quiet_until_ns_) return;
    quiet_until_ns_ = now_ns + kAnnounceEvery_ns;
    spdlog::info("percept gain held at {:.2f} on the stiffest joint: more the master would not render stably",
                 now.percept_gain);
  }

 private:
  using Row = std::tuple<teleop::BilateralLaw, teleop::Counterbalance, teleop::PerceptChoice>;
  std::optional<Row> row_;
  core::Nanoseconds quiet_until_ns_ = 0, damped_quiet_until_ns_ = 0;
};

/// Shares of the reports in which a guard of stability, or a cap, held drag or feedback back, or feedback
/// masked the drag. One thread
/// notes reports, another takes the shares.
class HeldShares {
 public:
  void note(const MasterOutputs& now) {
    ++reports_;
    guarded_ += now.damping_limited ? 1U : 0U;
    capped_ += now.percept_capped ? 1U : 0U;
    feedback_capped_ += now.feedback_capped ? 1U : 0U;
    drag_masked_ += now.drag_masked ? 1U : 0U;
  }
  /// Appends them as figures, and counts from 0 again.
  void append_to(std::vector<core::HealthFigure>& figures) {
    const unsigned reports = reports_.exchange(0);
    const auto share = [reports](std::atomic<unsigned>& count) {  // a report may be noted meanwhile
      const unsigned counted = count.exchange(0);
      return reports > 0 ? std::min(1.0, static_cast<double>(counted) / reports) : 0.0;
    };
    figures.push_back({"percept_guarded", share(guarded_), ""});
    figures.push_back({"percept_capped", share(capped_), ""});
    figures.push_back({"feedback_capped", share(feedback_capped_), ""});
    figures.push_back({"drag_masked", share(drag_masked_), ""});
  }

 private:
  std::atomic<unsigned> reports_{0}, guarded_{0}, capped_{0}, feedback_capped_{0}, drag_masked_{0};
};

/// Returns the strength of the motors' torque, 0…1, on the joint where it is greatest relative to the
/// percept's cap.
double felt_share(const MasterReport& now, const Config& config) {
  double share = 0.0;
  for (std::size_t j = 0; j < config.device.joint_count; ++j) {
    const double most_Nm = config.percept.torque_cap_Nm[j];
    if (most_Nm > 0.0) share = std::max(share, std::abs(now.outputs.motor_Nm[j]) / most_Nm);
  }
  return std::min(share, 1.0);
}

// Returns the configured device and waits for its buses; null if a stop was requested meanwhile.
std::unique_ptr<Device> make_device(const ArmModel& model, const Config& config, Inbox& inbox,
                                    DdsAdapter& adapter) {
  if (is_held_by_person(config) && config.driver == Driver::kCartesian)
    return std::make_unique<HapticDevice>(config, model.arm, model.home, inbox.haptic);
  if (config.driver == Driver::kCartesian)
    return std::make_unique<CartesianDevice>(config, model.arm, model.home);
  std::unique_ptr<Device> device;
  if (config.driver != Driver::kCan) {
    device = config.mapping ? std::make_unique<SimulatedDevice>(config.mapping->device,
                                                                start_of(*config.mapping, model.home))
                            : std::make_unique<SimulatedDevice>(config, model.home);
  } else {
    auto buses = runtime::open_buses(*config.can, [&](const std::string& missing) {
      adapter.publish_health({core::ComponentState::kStarting, "waiting: " + missing, {}, {}});
    });
    if (buses.empty()) return nullptr;
    device = std::make_unique<CanDevice>(config, std::move(buses));
  }
  if (!config.mapping) return device;
  return std::make_unique<MappedDevice>(*config.mapping, std::move(device), model.home);
}

// Returns the input of the operator's desk; null for another driver.
std::unique_ptr<ManualInput> make_desk(const Config& config, Servo& servo, DdsAdapter& adapter) {
  if (!uses_desk(config)) return nullptr;
  auto desk = std::make_unique<ManualInput>(
      config.desk, servo.desk,
      ManualInput::Listener{[&adapter] { adapter.emergency_stop("desk"); },
                            [&adapter] { adapter.reset("desk"); },
                            [](const std::string& what) { spdlog::info("desk: {}", what); },
                            [&adapter](bool open) { adapter.ask_gripper(open ? 1.0 : 0.0, "desk"); },
                            [&adapter](PerceptKey key) { adapter.choose_percepts(key, "desk"); }},
      config.scheduling.servo_priority);
  spdlog::info(
      "desk: {}; {}", desk->name(),
      config.desk.space_mouse
          ? "left button: clutch out, right button: emergency stop, third and fourth: gripper closed, open"
          : "Tab or shoulder: other joints, Esc or Select: emergency stop, Enter or Start: reset, "
            "C or A: gripper closed, O or B: open, 1, 2, 3 or cross left, up, right: drag, tone, views on or off, "
            "L or cross down: as the law has them");
  return desk;
}

std::optional<HapticNeeds> haptic_needs(const Config& config) {
  if (config.driver != Driver::kCartesian || !is_held_by_person(config)) return std::nullopt;
  const CartesianConfig& c = *config.cartesian;
  return HapticNeeds{c.hand.map.mass_kg, c.hand.map.inertia_kg_m2, c.wrench.force_cap_N,
                     c.wrench.moment_cap_N_m, c.hand.map.orientation};
}

core::Health health_of(const MasterReport& now, const core::DurationHistogram& trips,
                       std::vector<core::LoopStatistics> loops, bool simulated) {
  return {teleop::component_state(now.outputs),
          sentence(now),
          std::move(loops),
          {{"round_trip_p50", static_cast<double>(trips.quantile_ns(0.5)) * 1e-3, "µs"},
           {"round_trip_p99", static_cast<double>(trips.quantile_ns(0.99)) * 1e-3, "µs"},
           {"percept_gain", now.percept_gain, ""},
           {"feedback_delay", 1e3 * now.outputs.feedback_delay_s, "ms"},
           {"reach", static_cast<double>(now.reach), ""},
           {"simulated", simulated ? 1.0 : 0.0, ""}}};
}

// Runs the servo until a stop is requested. Returns the statistics of its loops.
std::vector<core::LoopStatistics> run_servo(const Config& config, Device& device, Servo& servo,
                                            runtime::StopFile& stops, DdsAdapter& adapter) {
  const auto desk = make_desk(config, servo, adapter);
  const auto enabling =
      runtime::SwitchInput::make(config.enabling_switch, servo.enabling, config.scheduling.servo_priority);
  EventLogger event_logger;
  HeldShares held;  // since the last status
  runtime::ServoCallbacks<MasterReport> callbacks;
  callbacks.report = [&](const MasterReport& report) {
    event_logger.look(report, core::monotonic_ns());
    held.note(report.outputs);
    if (desk) desk->rumble(felt_share(report, config));
  };
  callbacks.health = [&adapter, &held, simulated = !is_held_by_person(config)](
                         const MasterReport& now, std::vector<core::LoopStatistics> loops) {
    core::Health health = health_of(now, adapter.round_trips(), std::move(loops), simulated);
    held.append_to(health.figures);
    return health;
  };
  if (desk) callbacks.watched.push_back(&desk->progress());
  if (enabling) callbacks.watched.push_back(&enabling->progress());
  return runtime::run_servo_session({config.period_s, config.scheduling, config.measure_bare_loop}, servo,
                                    device, stops, adapter, runtime::LinkLogger("THE SLAVE"), callbacks);
}

}  // namespace

ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name) {
  const runtime::ArmConfig& config = cell.arm(arm_name);
  ArmModel model{runtime::load_arm(config), {}, {}};
  model.identity = runtime::identity_of(cell, arm_name, model.arm);
  std::copy(config.home.begin(), config.home.end(), model.home.begin());
  return model;
}

int joint_index(const ArmModel& model, const std::string& name) {
  if (name.empty()) return -1;
  const auto& joints = model.arm.joints();
  const auto found = std::ranges::find(joints, name, &robot::Joint::name);
  if (found == joints.end())
    throw core::ConfigError("--joint " + name + ": the arm has no such joint; allowed: " +
                            core::listed(joints, &robot::Joint::name));
  return static_cast<int>(found - joints.begin());
}

int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const runtime::StopPlace& stop_place,
                const std::filesystem::path& report_dir) {
  runtime::StopFile stops(stop_place, "master_io", network);
  if (!stops.notice().empty()) spdlog::warn("{}", stops.notice());
  Inbox inbox;
  core::NetworkOptions labelled = core::in_haptic_path(network, config.scheduling.servo_priority);
  labelled.model_label = robot::label_of(model.identity);
  DdsAdapter adapter(labelled,
                     {messages::bounds_of(model.arm, model.identity), config.percept.mode,
                      gain_rules(config, model.arm), haptic_needs(config)},
                     initial_settings(config), inbox);
  if (config.driver == Driver::kCan) {
    spdlog::info("the master's drives are on CAN: {}", fmt::join(config.can->addresses, ", "));
  } else if (is_held_by_person(config)) {
    spdlog::info("the master is a haptic device that another process serves (topic haptic_device)");
  } else {
    spdlog::info("THE MASTER IS SIMULATED (driver {})", name_of(config.driver));
  }
  if (is_scripted(config)) {
    spdlog::info("law {}, {} reaches, operator {}", teleop::name_of(config.feedback.law),
                 config.labels.size(), config.operator_model);
  } else {
    spdlog::info("law {}, moved by a person", teleop::name_of(config.feedback.law));
  }
  const auto device = make_device(model, config, inbox, adapter);
  if (!device) return runtime::kExitDone;
  Servo servo(config, model.home, *device, inbox, core::random_number(), stops);
  const std::vector<core::LoopStatistics> loops = run_servo(config, *device, servo, stops, adapter);
  if (!report_dir.empty()) {
    write_report(report_dir / "master_io.json",
                 {loops, adapter.round_trips(), device->cartesian_figures(), device->mapping_figures()},
                 servo.reaches(), config, cell);
  }
  return runtime::kExitDone;
}

}  // namespace phantom::master_io
