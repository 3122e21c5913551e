#include "components/slave_io/session.hpp"

#include <spdlog/spdlog.h>

#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "common/core/random.hpp"
#include "common/runtime/cell_bodies.hpp"
#include "common/runtime/loop_json.hpp"
#include "common/runtime/process.hpp"
#include "common/runtime/servo_runner.hpp"
#include "common/runtime/stop_file.hpp"
#include "components/slave_io/can_arm.hpp"
#include "components/slave_io/servo.hpp"
#include "components/slave_io/simulated_arm.hpp"

namespace phantom::slave_io {
namespace {

using Json = nlohmann::ordered_json;
using teleop::LinkState;

constexpr double kHealthPeriod_s = 0.5;

std::string sentence(const SlaveOutputs& now, const robot::SerialArm& arm) {
  switch (now.state) {
    case LinkState::kInit:
      return now.master_elsewhere ? "the master answers another slave_io: waiting" : "waiting for the master";
    case LinkState::kReady:
      if (now.far_joint < 0) return "coming to the master's pose";
      return "too far from the master to come by itself: bring the master nearer with " +
             arm.joints()[static_cast<std::size_t>(now.far_joint)].name;
    case LinkState::kDegraded:
      return now.master_elsewhere ? "the master answers another slave_io: holding position"
                                  : "the master is not heard: holding position";
    case LinkState::kStopped:
      return std::string(name_of(now.stop.cause)) + ": holding position until reset" +
             (now.master_unconfirmed ? "; THE MASTER HAS NOT CONFIRMED THAT IT IS STOPPED" : "");
    default:
      return "";
  }
}

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

void write_report(const std::filesystem::path& file, const std::vector<core::LoopStatistics>& loops,
                  const SimulatedArm* simulated, const runtime::CellConfig& cell) {
  Json report;
  for (const auto& loop : loops) report["loops"][loop.name] = runtime::loop_json(loop);
  if (simulated != nullptr) {
    report["contacts_seen"] = simulated->contacts().seen();
    report["contacts"] = contacts_json(simulated->contacts(), cell);
  }
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  stream << report.dump(2) << '\n';
}

// What is told twice a second: trouble with the drives before the state of the link.
core::Health health_of(const SlaveOutputs& now, const robot::SerialArm& arm,
                       const core::ActuatorHealth& driver, std::vector<core::LoopStatistics> loops) {
  core::ComponentState state = component_state(now.state);
  std::string message = sentence(now, arm);
  if (driver.fault) {
    state = core::ComponentState::kFault;
    message = driver.message;
  } else if (!driver.follows && now.state != LinkState::kStopped) {
    state = core::ComponentState::kStarting;
    message = driver.message;
  }
  return {state, message, std::move(loops), driver.figures};
}

void log_change(const SlaveOutputs& before, const SlaveOutputs& now) {
  if (now.master_unconfirmed && !before.master_unconfirmed)
    spdlog::error("THE MASTER HAS NOT CONFIRMED THAT IT IS STOPPED within {} s", teleop::kConfirmWithin_s);
  if (now.state == before.state) return;
  if (now.state == LinkState::kStopped) {
    spdlog::warn("link {} → stopped: {}", name_of(before.state), name_of(now.stop.cause));
  } else {
    spdlog::info("link {} → {}", name_of(before.state), name_of(now.state));
  }
}

// Runs the servo on `arm` until a stop is requested; returns how its loops ran.
std::vector<core::LoopStatistics> run_servo(const ArmModel& model, const Config& config, ArmDriver& arm,
                                            Inbox& inbox, runtime::StopFile& stops, DdsAdapter& adapter) {
  Servo servo(model, config, arm, inbox, core::random_number(), stops);
  std::mutex mutex;
  SlaveOutputs latest;  // under the mutex
  core::Progress publishing("publisher");
  std::jthread publisher([&](const std::stop_token& stop) {
    core::take_place(core::ThreadRole::kPublisher, config.scheduling.servo_priority);
    SlaveReport report;
    SlaveOutputs before;
    std::uint32_t signals = 0;
    while (!stop.stop_requested()) {
      publishing.tick();
      servo.published.wait(0.1);
      for (; signals != runtime::emergency_stop_signals(); ++signals) adapter.announce_stop("signal");
      if (!servo.outbox.read(report)) continue;
      adapter.publish(report);
      log_change(before, report.outputs);
      before = report.outputs;
      const std::lock_guard lock(mutex);
      latest = report.outputs;
    }
  });
  const auto now = [&] {
    const std::lock_guard lock(mutex);
    return latest;
  };
  runtime::ServoRunner loops(config.period_s, config.scheduling, config.measure_bare_loop,
                             [&servo](double dt_s) { servo.tick(dt_s, core::monotonic_ns()); });
  loops.watch(publishing);
  core::take_place(core::ThreadRole::kControl, config.scheduling.servo_priority);
  std::string said;
  do {
    stops.flush();
    const core::ActuatorHealth driver = arm.health();
    if (driver.message != said) {
      said = driver.message;
      if (driver.fault) {
        spdlog::error("drives: {}", said);
      } else {
        spdlog::info("drives: {}", said.empty() ? "all follow" : said);
      }
    }
    adapter.publish_health(health_of(now(), model.arm, driver, loops.statistics()));
    if (const std::string refused = loops.take_notice(); !refused.empty())
      spdlog::warn("servo thread: {}", refused);
  } while (runtime::sleep_unless_stopped(kHealthPeriod_s));
  loops.stop();
  arm.end(core::monotonic_ns());
  publisher.request_stop();
  publisher.join();
  return loops.statistics();
}

void finish(DdsAdapter& adapter, const std::vector<core::LoopStatistics>& loops,
            const SimulatedArm* simulated, const runtime::CellConfig& cell,
            const std::filesystem::path& report_dir) {
  adapter.publish_health({core::ComponentState::kStopped, "ended", loops, {}});
  if (!report_dir.empty()) write_report(report_dir / "slave_io.json", loops, simulated, cell);
}

// Null: the process was told to end meanwhile.
std::unique_ptr<const FieldWorld> make_world(const runtime::CellConfig& cell, const ContactConfig& config,
                                             const FieldCache& cache) {
  try {
    return std::make_unique<const FieldWorld>(
        cell, runtime::load_real_bodies(cell), config, [] { return !runtime::stop_requested(); }, &cache);
  } catch (const FieldWorld::Ended&) {
    return nullptr;
  }
}

int run_simulated(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                  const core::NetworkOptions& network, runtime::StopFile& stops, const FieldCache& cache,
                  const std::filesystem::path& report_dir) {
  spdlog::info("placing {} objects where they really stand", cell.objects.size());
  const auto begun_ns = core::monotonic_ns();
  // The others find it meanwhile.
  Inbox inbox;
  DdsAdapter adapter(core::in_haptic_path(network, config.scheduling.servo_priority),
                     messages::bounds_of(model.arm), inbox);
  adapter.publish_health({core::ComponentState::kStarting, "making the contact field", {}, {}});
  const auto world = make_world(cell, config.contact, cache);
  if (!world) {
    adapter.publish_health({core::ComponentState::kStopped, "ended", {}, {}});
    return runtime::kExitDone;
  }
  SimulatedArm arm(model, config, *world);
  spdlog::info("contact field of {:.1f} MB made in {:.1f} s; {} contact points on {} joints",
               static_cast<double>(world->bytes()) * 1e-6, core::seconds(core::monotonic_ns() - begun_ns),
               arm.contact_point_count(), model.arm.joint_count());
  finish(adapter, run_servo(model, config, arm, inbox, stops, adapter), &arm, cell, report_dir);
  return runtime::kExitDone;
}

int run_drives(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
               const core::NetworkOptions& network, runtime::StopFile& stops,
               const std::filesystem::path& report_dir) {
  Inbox inbox;
  DdsAdapter adapter(core::in_haptic_path(network, config.scheduling.servo_priority),
                     messages::bounds_of(model.arm), inbox);
  auto buses = runtime::open_buses(*config.can, [&](const std::string& missing) {
    adapter.publish_health({core::ComponentState::kStarting, "waiting: " + missing, {}, {}});
  });
  if (buses.empty()) return runtime::kExitDone;
  for (std::size_t b = 0; b < buses.size(); ++b) {
    const can::BusLoad load = can::bus_load(config.can->group, b);
    spdlog::info("{}: {:.0f} % of {:.0f} kbit/s planned at worst, {} frames in each cycle of {:.1f} ms",
                 config.can->addresses[b], 100.0 * load.share, config.can->group.bit_rates[b] * 1e-3,
                 load.frames_per_cycle, config.period_s * 1e3);
  }
  CanArm arm(model, config, std::move(buses));
  finish(adapter, run_servo(model, config, arm, inbox, stops, adapter), nullptr, cell, report_dir);
  return runtime::kExitDone;
}

}  // namespace

int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const std::filesystem::path& state_dir,
                const std::filesystem::path& report_dir) {
  runtime::StopFile stops(state_dir, "slave_io", network);
  if (!stops.notice().empty()) spdlog::warn("{}", stops.notice());
  return config.driver == Driver::kCan ? run_drives(cell, model, config, network, stops, report_dir)
                                       : run_simulated(cell, model, config, network, stops,
                                                       FieldCache(state_dir / "contact_fields"), report_dir);
}

}  // namespace phantom::slave_io
