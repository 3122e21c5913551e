#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_place.hpp"
#include "common/runtime/periodic_loop.hpp"
#include "common/runtime/process.hpp"
#include "common/runtime/servo_runner.hpp"
#include "common/runtime/stop_file.hpp"
#include "common/teleop/servo_side.hpp"

namespace phantom::runtime {

/// Logs changes of the link's state, and a partner that has not confirmed a stop.
class LinkAnnouncer {
 public:
  /// `partner`: in capitals, "THE SLAVE".
  explicit LinkAnnouncer(std::string partner) : partner_(std::move(partner)) {}
  void look(const teleop::SideOutputs& now);

 private:
  std::string partner_;
  teleop::SideOutputs before_;
};

/// Logs why an actuator does not follow, whenever the reason changes.
class ActuatorAnnouncer {
 public:
  void look(const core::ActuatorHealth& actuator);

 private:
  std::string said_;
};

/// Returns `health` with the actuator's figures added. Trouble with the actuator replaces state and message.
core::Health with_actuator(core::Health health, const core::ActuatorHealth& actuator, teleop::LinkState link);

/// Logs what the servo's thread was refused at its set-up, if anything.
void log_notice(const std::string& refused);

struct ServoTiming {
  double period_s = 0.001;
  LoopScheduling scheduling;
  bool with_bare_loop = false;
};

/// Callbacks and threads that a side adds to the session of its servo.
template <class Report>
struct ServoTold {
  /// Handles a new report beyond its topic; called on the publishing thread. May be empty.
  std::function<void(const Report&)> report;
  /// Returns the side's health from its newest report and the statistics of the loops; called twice a second.
  std::function<core::Health(const Report&, std::vector<core::LoopStatistics>)> health;
  std::vector<const core::Progress*> watched =
      {};  ///< threads whose statistics are added to those of the loops
};

/// Runs a side until the process has to end. The servo runs on a thread of its own. A second thread publishes
/// its reports, and announces a stop to all when a signal requested one. The calling thread publishes health
/// twice a second. At the end the loops stop first, then the actuator is ended, and a last health report says
/// that the side has ended. Returns the statistics of the loops.
///
/// Required members: `servo` has tick(dt_s, now_ns), a Snapshot `outbox` of Report and a WakeSignal
/// `published`. `adapter` has publish(Report), announce_stop(issuer) and publish_health(Health). `actuator`
/// has health() and end(now_ns).
template <class Report, class Servo, class Adapter, class Actuator>
std::vector<core::LoopStatistics> run_servo_session(const ServoTiming& timing, Servo& servo,
                                                    Actuator& actuator, StopFile& stops, Adapter& adapter,
                                                    LinkAnnouncer announcer, const ServoTold<Report>& told) {
  constexpr double kHealthPeriod_s = 0.5;
  std::mutex mutex;
  Report latest;  // guarded by the mutex
  core::Progress publishing("publisher");
  std::jthread publisher([&](const std::stop_token& stop) {
    core::take_place(core::ThreadRole::kPublisher, timing.scheduling.servo_priority);
    Report report;
    std::uint32_t signals = 0;
    while (!stop.stop_requested()) {
      publishing.tick();
      servo.published.wait(0.1);
      for (; signals != emergency_stop_signals(); ++signals) adapter.announce_stop("signal");
      if (!servo.outbox.read(report)) continue;
      adapter.publish(report);
      announcer.look(report.outputs);
      if (told.report) told.report(report);
      const std::lock_guard lock(mutex);
      latest = report;
    }
  });
  ServoRunner loops(timing.period_s, timing.scheduling, timing.with_bare_loop,
                    [&servo](double dt_s) { servo.tick(dt_s, core::monotonic_ns()); });
  loops.watch(publishing);
  for (const core::Progress* thread : told.watched) loops.watch(*thread);
  core::take_place(core::ThreadRole::kControl, timing.scheduling.servo_priority);
  ActuatorAnnouncer actuators;
  const auto health = [&] {
    const core::ActuatorHealth driver = actuator.health();
    actuators.look(driver);
    const std::lock_guard lock(mutex);
    return with_actuator(told.health(latest, loops.statistics()), driver, latest.outputs.state);
  };
  do {
    stops.flush();
    adapter.publish_health(health());
    log_notice(loops.take_notice());
  } while (sleep_unless_stopped(kHealthPeriod_s));
  loops.stop();
  actuator.end(core::monotonic_ns());
  publisher.request_stop();
  publisher.join();
  core::Health last = health();
  last.state = core::ComponentState::kStopped;
  last.message = "ended";
  adapter.publish_health(last);
  return loops.statistics();
}

}  // namespace phantom::runtime
