#include "components/slave_io/session.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "common/core/random.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/servo/loop_json.hpp"
#include "common/runtime/servo/servo_session.hpp"
#include "common/runtime/servo/switch_input.hpp"
#include "components/slave_io/can_arm.hpp"
#include "components/slave_io/can_gripper.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"
#include "components/slave_io/simulated_gripper.hpp"
#include "components/slave_io/simulated_world.hpp"
#include "components/slave_io/wrist_input.hpp"

namespace phantom::slave_io {
namespace {

using Json = nlohmann::ordered_json;
using teleop::LinkState;

// Says what the operator is to know while the arm holds its force on what it presses on.
std::string pressing_sentence(const SlaveOutputs& now, const robot::SerialArm& arm,
                              std::span<const ObjectForceBound> objects) {
  if (now.pressing_object) {
    const auto object = std::ranges::find(objects, now.pressed_object, &ObjectForceBound::object);
    return fmt::format("the arm presses on {}{} with {:.2g} N, as hard as it may: it goes no farther",
                       now.touches_it ? "" : "what may be ",
                       object != objects.end() ? object->name : "something unknown", now.pressing_effort);
  }
  if (now.pressing_tool)
    return fmt::format("the tool presses with {:.0f} N, as hard as it may: it goes no farther",
                       now.pressing_effort);
  const robot::Joint& joint = arm.joints()[static_cast<std::size_t>(now.pressing_joint)];
  const bool slides = joint.type == robot::JointType::kPrismatic;
  return fmt::format("{} presses with {:.2g} {}, as hard as it may: it goes no farther", joint.name,
                     now.pressing_effort, slides ? "N" : "N·m");
}

}  // namespace

std::string sentence(const SlaveOutputs& now, const robot::SerialArm& arm,
                     std::span<const ObjectForceBound> objects) {
  if (teleop::waits_for_switch(now)) return teleop::switch_sentence(now, "master");
  switch (now.state) {
    case LinkState::kInit:
      if (now.peer_has_other_model) return "the master works with another arm or cell: waiting";
      return now.peer_bound_elsewhere ? "the master answers another slave_io: waiting"
                                      : "waiting for the master";
    case LinkState::kReady:
      if (now.far_joint < 0) return "coming to the master's pose";
      return "too far from the master to come by itself: bring the master nearer with " +
             arm.joints()[static_cast<std::size_t>(now.far_joint)].name;
    case LinkState::kDegraded:
      if (now.peer_has_other_model) return "the master works with another arm or cell: holding position";
      return now.peer_bound_elsewhere ? "the master answers another slave_io: holding position"
                                      : "master lost: holding position";
    case LinkState::kStopped:
      return std::string(name_of(now.stop.cause)) + ": holding position until reset" +
             (now.partner_unconfirmed ? "; THE MASTER HAS NOT CONFIRMED THAT IT IS STOPPED" : "");
    case LinkState::kCoupled:
      return now.pressing_joint >= 0 || now.pressing_tool || now.pressing_object
                 ? pressing_sentence(now, arm, objects)
                 : "";
    default:
      return "";
  }
}

namespace {

Json contacts_json(const ContactLog& contacts, const runtime::CellConfig& cell) {
  Json list = Json::array();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactEpisode& c = contacts[i];
    const bool known = c.object >= 1 && c.object <= cell.objects.size();
    list.push_back({{"t", c.start_s},
                    {"duration_s", c.duration_s},
                    {"object", known ? cell.objects[c.object - 1].name : ""},
                    {"tool_speed_m_s", c.tool_speed_m_s},
                    {"peak_force_N", c.peak_force_N},
                    {"point_m", {c.point_W_m.x(), c.point_W_m.y(), c.point_W_m.z()}}});
  }
  return list;
}

// Where the loose objects are in the end.
Json loose_json(const simulation::SlavePlant& plant, const runtime::CellConfig& cell) {
  Json list = Json::array();
  for (std::size_t i = 0; i < plant.loose().size(); ++i) {
    const geometry::Pose X_WO = plant.pose_of_loose(i);
    const Eigen::Vector3d& p = X_WO.translation_m;
    const Eigen::Vector4d q = geometry::quaternion_xyzw(X_WO.rotation);
    list.push_back({{"object", cell.objects[plant.loose().id(i) - 1U].name},
                    {"position_m", {p.x(), p.y(), p.z()}},
                    {"quaternion_xyzw", {q[0], q[1], q[2], q[3]}},
                    {"held", plant.holds(i)}});
  }
  return list;
}

void write_report(const std::filesystem::path& file, const std::vector<core::LoopStatistics>& loops,
                  const SimulatedArm* simulated, const runtime::CellConfig& cell) {
  Json report;
  for (const auto& loop : loops) report["loops"][loop.name] = runtime::loop_json(loop);
  if (simulated != nullptr) {
    report["contacts_seen"] = simulated->contacts().seen();
    report["contacts"] = contacts_json(simulated->contacts(), cell);
    report["loose"] = loose_json(simulated->plant(), cell);
  }
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  stream << report.dump(2) << '\n';
}

// The configured gripper of an arm with drives; null if there is none. Waits for its bus, which is the arm's.
std::unique_ptr<GripperDriver> make_gripper(const Config& config) {
  if (!config.gripper) return nullptr;
  auto buses = runtime::open_buses(*config.gripper->drive, [](const std::string&) {});
  if (buses.empty()) return nullptr;
  return std::make_unique<CanGripper>(config.gripper->drive->group, std::move(buses.front()));
}

// Adds what the operator has to know of the sensor at the wrist, and logs it when it changes.
class WristReporter {
 public:
  void add_to(core::Health& health, const SlaveReport& now, const Config& config) {
    bool hinders = false;
    const std::string sentence = wrist_sentence(now.wrist, hinders);
    if (sentence != logged_ && !sentence.empty()) spdlog::info("{}", sentence);
    logged_ = sentence;
    if (hinders && health.state == core::ComponentState::kRunning)
      health.state = core::ComponentState::kDegraded;
    health.message += (health.message.empty() || sentence.empty() ? "" : "; ") + sentence;
    health.figures.insert(health.figures.end(),
                          {{"force_lag", force_lag_s(*config.wrist, config.period_s), "s"},
                           {"force_threshold", config.wrist->sensor.threshold_N, "N"},
                           {"force_offset", now.wrist.offset_N, "N"},
                           {"force_offset_torque", now.wrist.offset_Nm, "Nm"}});
  }

 private:
  std::string logged_;
};

// Opens the sensor at the wrist if force_sensor is wanted of it. Returns false if the process has to end
// while its bus is waited for.
bool open_wrist(const ArmModel& model, const Config& config, Inbox& inbox, DdsAdapter& adapter,
                std::unique_ptr<WristInput>& wrist) {
  if (!config.force_sensor || !config.wrist) return true;
  std::unique_ptr<can::CanBus> bus;
  const std::string& address = config.wrist->address;
  if (!address.empty()) {
    runtime::DrivesConfig own{.addresses = {address}};
    if (config.can) own.bus_wait_s = config.can->bus_wait_s;
    auto opened = runtime::open_buses(own, [&](const std::string& missing) {
      adapter.publish_health({core::ComponentState::kStarting, "waiting: " + missing, {}, {}});
    });
    if (opened.empty()) return false;
    bus = std::move(opened.front());
  }
  spdlog::info("external torques by the sensor at the wrist ({}): behind by {:.0f} ms, zero below {:.3g} N",
               address.empty() ? "topic wrist_wrench" : address,
               1e3 * force_lag_s(*config.wrist, config.period_s), config.wrist->sensor.threshold_N);
  wrist = std::make_unique<WristInput>(model, *config.wrist, inbox, std::move(bus));
  return true;
}

// Runs the servo on `arm` and `gripper`, if there is one, until a stop is requested. Returns the statistics
// of its loops.
std::vector<core::LoopStatistics> run_servo(const ArmModel& model, const Config& config, ArmDriver& arm,
                                            GripperDriver* gripper, Inbox& inbox, runtime::StopFile& stops,
                                            DdsAdapter& adapter) {
  std::unique_ptr<WristInput> wrist;
  if (!open_wrist(model, config, inbox, adapter, wrist)) return {};
  Servo servo(model, config, arm, inbox, core::random_number(), stops, gripper, wrist.get());
  const auto enabling =
      runtime::SwitchInput::make(config.enabling_switch, servo.enabling, config.scheduling.servo_priority);
  runtime::ActuatorLogger gripper_logger;
  WristReporter wrist_reporter;
  runtime::ServoCallbacks<SlaveReport> callbacks;
  if (enabling) callbacks.watched.push_back(&enabling->progress());
  callbacks.health = [&](const SlaveReport& now, std::vector<core::LoopStatistics> loops) -> core::Health {
    core::Health health{teleop::component_state(now.outputs),
                        sentence(now.outputs, model.arm, config.object_bounds),
                        std::move(loops),
                        {{"simulated", config.driver == Driver::kSimulated ? 1.0 : 0.0, ""}}};
    if (wrist) wrist_reporter.add_to(health, now, config);
    if (gripper == nullptr) return health;
    const core::ActuatorHealth its = gripper->health();
    gripper_logger.update(its);
    return with_gripper(std::move(health), its, now.gripper.value_or(messages::GripperState()));
  };
  return runtime::run_servo_session({config.period_s, config.scheduling, config.measure_bare_loop}, servo,
                                    arm, stops, adapter, runtime::LinkLogger("THE MASTER"), callbacks);
}

// Reports twice a second that the process is alive: on a slow host this takes longer than a service manager
// waits for a word. After ten minutes it hangs and reports no more.
SimulatedWorld make_world(const runtime::CellConfig& cell, const ArmModel& model, const ContactConfig& config,
                          DdsAdapter& adapter) {
  constexpr core::Nanoseconds kMax_ns = core::from_seconds(600.0);
  auto making = std::async(std::launch::async, [&] {
    core::apply_thread_config(core::ThreadRole::kHelper);
    return load_world(cell, model, config);
  });
  const auto begun_ns = core::monotonic_ns();
  do {
    if (core::monotonic_ns() - begun_ns < kMax_ns)
      adapter.publish_health({core::ComponentState::kStarting, "placing the bodies", {}, {}});
  } while (making.wait_for(std::chrono::milliseconds(500)) != std::future_status::ready);
  return making.get();
}

int run_simulated(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                  const core::NetworkOptions& network, runtime::StopFile& stops,
                  const std::filesystem::path& report_dir) {
  spdlog::info("THE ARM IS SIMULATED (driver sim)");
  spdlog::info("placing {} objects where they really stand", cell.objects.size());
  const auto begun_ns = core::monotonic_ns();
  // Lets the others find this process while the bodies are loaded.
  Inbox inbox;
  if (config.gripper) inbox.gripper.open(config.gripper->limits);
  DdsAdapter adapter(core::in_haptic_path(network, config.scheduling.servo_priority),
                     messages::bounds_of(model.arm, model.identity), inbox);
  SimulatedWorld world = make_world(cell, model, config.contact, adapter);
  PayloadRule rule{&model.arm, model.name, config.max_payload_kg, {}, model.object_volumes_m3};
  for (const simulation::LooseObject& object : world.loose) rule.weighed.push_back(object.id);
  if (world.yielding)
    spdlog::info("the arm feels {} media, and what is soft, with {} points of its skin", cell.media.size(),
                 world.yielding->sensors());
  SimulatedArm arm(model, config, *world.fixed, std::move(world.loose), std::move(world.yielding));
  spdlog::info("the bodies stand after {:.2f} s; {} contact points on {} joints",
               core::seconds(core::monotonic_ns() - begun_ns), arm.contact_point_count(),
               model.arm.joint_count());
  adapter.follow_workspace(rule, config.object_bounds);
  std::optional<SimulatedGripper> gripper;
  if (config.gripper) gripper.emplace(arm.plant());
  const auto loops = run_servo(model, config, arm, gripper ? &*gripper : nullptr, inbox, stops, adapter);
  if (!report_dir.empty()) write_report(report_dir / "slave_io.json", loops, &arm, cell);
  return runtime::kExitDone;
}

int run_drives(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
               const core::NetworkOptions& network, runtime::StopFile& stops,
               const std::filesystem::path& report_dir) {
  spdlog::info("the arm's drives are on CAN: {}", fmt::join(config.can->addresses, ", "));
  Inbox inbox;
  if (config.gripper) inbox.gripper.open(config.gripper->limits);
  DdsAdapter adapter(core::in_haptic_path(network, config.scheduling.servo_priority),
                     messages::bounds_of(model.arm, model.identity), inbox);
  auto buses = runtime::open_buses(*config.can, [&](const std::string& missing) {
    adapter.publish_health({core::ComponentState::kStarting, "waiting: " + missing, {}, {}});
  });
  if (buses.empty()) return runtime::kExitDone;
  can::DriveGroupConfig planned = config.can->group;
  if (config.can->gripper) planned.axes.push_back(*config.can->gripper);
  for (std::size_t b = 0; b < buses.size(); ++b) {
    const can::BusLoad load = can::bus_load(planned, b);
    spdlog::info("{}: {:.0f} % of {:.0f} kbit/s planned at worst, {} frames in each cycle of {:.1f} ms",
                 config.can->addresses[b], 100.0 * load.share, config.can->group.bit_rates[b] * 1e-3,
                 load.frames_per_cycle, config.period_s * 1e3);
  }
  if (config.force_sensor && config.force_observer) {
    const auto& threshold_Nm = config.force_observer->threshold_Nm;
    spdlog::info("{} by the drives' torque: behind by {:.0f} ms, zero below {:.3g} N·m or N",
                 config.wrist ? "contact" : "external torques", 1e3 * force_lag_s(config),
                 fmt::join(threshold_Nm.begin(), threshold_Nm.begin() + model.arm.joint_count(), ", "));
  }
  CanArm arm(model, config, std::move(buses));
  adapter.follow_workspace({&model.arm, model.name, config.max_payload_kg, {}, model.object_volumes_m3},
                           config.object_bounds);
  const auto gripper = make_gripper(config);
  const auto loops = run_servo(model, config, arm, gripper.get(), inbox, stops, adapter);
  if (!report_dir.empty()) write_report(report_dir / "slave_io.json", loops, nullptr, cell);
  return runtime::kExitDone;
}

}  // namespace

int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const runtime::StopPlace& stop_place,
                const std::filesystem::path& report_dir) {
  runtime::StopFile stops(stop_place, "slave_io", network);
  if (!stops.notice().empty()) spdlog::warn("{}", stops.notice());
  core::NetworkOptions labelled = network;
  labelled.model_label = robot::label_of(model.identity);
  return config.driver == Driver::kCan ? run_drives(cell, model, config, labelled, stops, report_dir)
                                       : run_simulated(cell, model, config, labelled, stops, report_dir);
}

}  // namespace phantom::slave_io
