#include <spdlog/spdlog.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <utility>

#include "common/can/user_bus.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/process.hpp"
#include "common/simulation/user_bus_hub.hpp"
#include "components/simulated_drive/config.hpp"
#include "components/simulated_drive/faults.hpp"
#include "components/simulated_drive/force_sensor.hpp"
#include "components/simulated_drive/motion_record.hpp"

namespace {

using namespace phantom;

struct Options {
  std::string bus;
  std::vector<int> nodes;
  std::vector<std::string> faults;
  std::filesystem::path record;
  simulation::FaultRule bus_fault;
  double delay_ms = 0.0, jitter_ms = 0.0;
  bool serve_only = false, eds = false;
};

void add_options(runtime::Command app, Options& o) {
  app.option("--bus", o.bus, "can0 or another SocketCAN interface, or user:NAME; instead of the file's");
  app.option("--nodes", o.nodes, "only these of the file's node ids").separated_by(',');
  app.option("--fault", o.faults, "KIND@SECONDS[:NODE]: a fault that begins then; may be given again");
  app.option(
      "--record", o.record,
      "append each drive's torque and motion to this file of comma-separated values: CLOCK_MONOTONIC "
      "(ns), node, power state, torque at the joint (N·m), angle (rad), speed (rad/s), whether it reports its motion truly");
  app.option("--drop", o.bus_fault.drop, "share of frames that the bus loses (userspace bus only)")
      .between(0.0, 1.0);
  app.option("--duplicate", o.bus_fault.duplicate,
             "share of frames that the bus repeats (userspace bus only)")
      .between(0.0, 1.0);
  app.option("--delay-ms", o.delay_ms, "every frame comes so much later (userspace bus only)")
      .between(0.0, 10000.0);
  app.option("--jitter-ms", o.jitter_ms, "and up to so much more, each for itself (userspace bus only)")
      .between(0.0, 10000.0);
  app.flag("--eds", o.eds, "print the drives' electronic data sheet (CiA 306), for CANopen tools, and end");
  app.flag("--serve-only", o.serve_only, "serve the userspace bus, without drives");
}

// Serves a userspace bus unless another process serves it already.
std::unique_ptr<simulation::UserBusHub> serve(const std::string& address,
                                              const simulated_drive::Config& config, const Options& o) {
  if (!can::is_user_address(address)) return nullptr;
  auto hub = simulation::UserBusHub::serve(address, {.bit_rate = config.bit_rate});
  if (!hub && hub.status().code() == core::ErrorCode::kFailedPrecondition && !o.serve_only) return nullptr;
  if (!hub) throw core::ConfigError(hub.status().message());
  (*hub)->set_faults({o.bus_fault});
  return std::move(hub).value();
}

std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> make_drives(
    const simulated_drive::Config& config, const Options& o) {
  std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>> drives;
  for (const auto& drive : config.drives) {
    if (!o.nodes.empty() && std::find(o.nodes.begin(), o.nodes.end(), drive.node) == o.nodes.end()) continue;
    auto bus = can::open_bus(config.bus);
    if (!bus) throw core::MissingError(bus.status().message());
    drives.push_back(std::make_unique<simulated_drive::SimulatedDrive>(drive, std::move(bus).value()));
  }
  if (drives.empty()) throw core::ConfigError("--nodes: none of them is in the configuration");
  return drives;
}

// The record that --record asks for.
class Record {
 public:
  explicit Record(const std::filesystem::path& path) {
    if (path.empty()) return;
    auto file = simulated_drive::MotionRecord::open(path);
    if (!file) throw core::MissingError(file.status().message());
    file_ = std::move(file).value();
  }
  void note(const std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>>& drives,
            core::Nanoseconds now_ns) {
    if (!file_) return;
    for (std::size_t i = 0; i < drives.size(); ++i) file_->note(i, *drives[i], now_ns);
    if (now_ns - flushed_ns_ < kFlushPeriod_ns) return;
    flushed_ns_ = now_ns;
    if (!file_->flush() && !std::exchange(lost_, true)) spdlog::warn("--record: rows are lost");
  }

 private:
  static constexpr core::Nanoseconds kFlushPeriod_ns = 100 * core::kNsPerMillisecond;
  std::optional<simulated_drive::MotionRecord> file_;
  core::Nanoseconds flushed_ns_ = 0;
  bool lost_ = false;
};

// The sensor at the wrist; none if its drive is not served here.
std::unique_ptr<simulated_drive::SimulatedForceSensor> make_sensor(
    const simulated_drive::Config& config,
    const std::vector<std::unique_ptr<simulated_drive::SimulatedDrive>>& drives) {
  for (std::size_t i = 0; config.force_sensor && i < drives.size(); ++i) {
    if (drives[i]->node() != config.force_sensor->node) continue;
    auto bus = can::open_bus(config.bus);
    if (!bus) throw core::MissingError(bus.status().message());
    if (const core::Status status = (*bus)->set_filters({}); !status)
      throw core::ConfigError(status.message());
    return std::make_unique<simulated_drive::SimulatedForceSensor>(*config.force_sensor, drives[i]->motor(),
                                                                   std::move(bus).value());
  }
  return nullptr;
}

int run(const runtime::ProcessOptions& options, Options o) {
  if (o.eds) {
    std::cout << simulated_drive::kDataSheet << '\n';
    return runtime::kExitDone;
  }
  simulated_drive::Config config = simulated_drive::load_config(options.config);
  if (!o.bus.empty()) config.bus = o.bus;
  o.bus_fault.delay_ns = core::from_seconds(o.delay_ms * 1e-3);
  o.bus_fault.jitter_ns = core::from_seconds(o.jitter_ms * 1e-3);
  std::vector<simulated_drive::TimedFault> faults;
  for (const std::string& text : o.faults) faults.push_back(simulated_drive::parse_fault(text));
  if (options.check) return runtime::configuration_is_valid();
  const auto hub = serve(config.bus, config, o);
  if (hub) spdlog::info("serving {}", config.bus);
  while (o.serve_only && runtime::sleep_unless_stopped(1.0)) {
  }
  if (o.serve_only) return runtime::kExitDone;
  Record record(o.record);
  auto drives = make_drives(config, o);
  const auto sensor = make_sensor(config, drives);
  spdlog::info("{} drives on {}", drives.size(), config.bus);
  if (const std::string refused = core::apply_thread_config(core::ThreadRole::kDrives, core::kServoPriority);
      !refused.empty())
    spdlog::warn("{}", refused);
  const core::Nanoseconds start_ns = core::monotonic_ns();
  while (!runtime::stop_requested()) {
    const core::Nanoseconds now_ns = core::monotonic_ns();
    for (std::size_t i = 0; i < drives.size(); ++i) drives[i]->step(now_ns);
    if (sensor) sensor->step(now_ns);
    record.note(drives, now_ns);
    for (auto& fault : faults) {
      if (fault.done || core::seconds(now_ns - start_ns) < fault.at_s) continue;
      fault.done = true;
      spdlog::warn("fault: {}", fault.kind);
      for (std::size_t i = 0; i < drives.size(); ++i) {
        if (fault.node == 0 || fault.node == drives[i]->node())
          simulated_drive::apply(fault.kind, *drives[i]);
      }
    }
    if (drives.front()->bus().state() == can::BusState::kDown)
      throw core::MissingError(config.bus + ": is down");
    drives.front()->wait(core::kNsPerMillisecond);
  }
  return runtime::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  Options own;
  runtime::ProcessDescription description;
  description.name = "simulated_drive";
  description.summary =
      "Servo drives without hardware: CiA 402 on a CAN bus, with motors, gears and friction behind them. "
      "For trying slave and master with their real drive code.";
  description.details =
      "Example: simulated_drive --bus user:arm --fault trip@10:2\n"
      "A userspace bus is served by the first process that names it. Faults (--fault):\n" +
      simulated_drive::fault_help();
  description.add_options = [&own](runtime::Command app) { add_options(app, own); };
  description.parameters = {simulated_drive::kParameters};
  description.run = [&own](const runtime::ProcessOptions& options) { return run(options, own); };
  return runtime::process_main(argc, argv, description);
}
