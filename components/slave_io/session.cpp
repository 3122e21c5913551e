#include "components/slave_io/session.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/runtime/cell_bodies.hpp"
#include "common/runtime/process.hpp"
#include "common/runtime/servo_runner.hpp"
#include "components/slave_io/dds_adapter.hpp"
#include "components/slave_io/servo.hpp"

namespace phantom::slave_io {
namespace {

using Json = nlohmann::ordered_json;
using teleop::LinkState;

constexpr double kHealthPeriod_s = 0.5;

std::string sentence(LinkState link) {
  switch (link) {
    case LinkState::kInit:
      return "waiting for the master";
    case LinkState::kReady:
      return "coming to the master's pose";
    case LinkState::kDegraded:
      return "the master is not heard: holding position";
    case LinkState::kStopped:
      return "emergency stop: holding position until reset";
    default:
      return "";
  }
}

Json loop_json(const core::LoopStatistics& loop) {
  return {
      {"period_s", loop.period_s},       {"rate_hz", loop.rate_hz},      {"p50_us", loop.wakeup_p50_us},
      {"p99_us", loop.wakeup_p99_us},    {"max_us", loop.wakeup_max_us}, {"work_p50_us", loop.work_p50_us},
      {"work_max_us", loop.work_max_us}, {"ticks", loop.ticks},          {"slips", loop.slips}};
}

void write_report(const std::filesystem::path& file, const std::vector<core::LoopStatistics>& loops,
                  const ContactLog& contacts, const runtime::CellConfig& cell) {
  Json report;
  for (const auto& loop : loops) report["loops"][loop.name] = loop_json(loop);
  report["contacts_seen"] = contacts.seen();
  report["contacts"] = Json::array();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const ContactEpisode& c = contacts[i];
    const bool known = c.object >= 1 && c.object <= cell.objects.size();
    report["contacts"].push_back({{"t", c.start_s},
                                  {"duration_s", c.duration_s},
                                  {"object", known ? cell.objects[c.object - 1].name : ""},
                                  {"tool_speed_m_s", c.tool_speed_m_s},
                                  {"peak_force_N", c.peak_force_N},
                                  {"point_m", {c.point_W_m.x(), c.point_W_m.y(), c.point_W_m.z()}}});
  }
  std::ofstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  stream << report.dump(2) << '\n';
}

}  // namespace

int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const std::filesystem::path& report_dir) {
  spdlog::info("placing {} objects where they really stand", cell.objects.size());
  const auto begun_ns = core::monotonic_ns();
  const FieldWorld world(cell, runtime::load_real_bodies(cell), config.contact);
  Inbox inbox;
  Servo servo(model, config, world, inbox);
  spdlog::info("contact field of {:.1f} MB made in {:.1f} s; {} contact points on {} joints",
               static_cast<double>(world.bytes()) * 1e-6, core::seconds(core::monotonic_ns() - begun_ns),
               servo.contact_point_count(), model.arm.joint_count());
  DdsAdapter adapter(network, model.arm.joint_count(), inbox);

  std::atomic<LinkState> link{LinkState::kInit};
  std::atomic<double> clearance_m{-1.0};
  std::jthread publisher([&](const std::stop_token& stop) {
    SlaveReport report;
    std::uint32_t signals = 0;
    while (!stop.stop_requested()) {
      servo.published.wait(0.1);
      for (; signals != runtime::emergency_stop_signals(); ++signals) adapter.emergency_stop("signal");
      if (!servo.outbox.read(report)) continue;
      adapter.publish(report);
      const LinkState before = link.exchange(report.outputs.state);
      clearance_m = report.clearance_m;
      if (before != report.outputs.state)
        spdlog::info("link {} → {}", name_of(before), name_of(report.outputs.state));
    }
  });
  runtime::ServoRunner loops(config.period_s, config.scheduling, config.measure_bare_loop,
                             [&servo](double dt_s) { servo.tick(dt_s, core::monotonic_ns()); });

  do {
    adapter.publish_health(
        {component_state(link), sentence(link), loops.statistics(), {{"clearance", clearance_m, "m"}}});
  } while (runtime::sleep_unless_stopped(kHealthPeriod_s));

  loops.stop();
  publisher.request_stop();
  publisher.join();
  if (!loops.notice().empty()) spdlog::warn("servo thread: {}", loops.notice());
  adapter.publish_health({core::ComponentState::kStopped, "ended", loops.statistics(), {}});
  if (!report_dir.empty())
    write_report(report_dir / "slave_io.json", loops.statistics(), servo.contacts(), cell);
  return runtime::kExitDone;
}

}  // namespace phantom::slave_io
