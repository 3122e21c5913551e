#pragma once

#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_config.hpp"
#include "common/runtime/process/process.hpp"
#include "common/runtime/process/stop_file.hpp"
#include "common/runtime/servo/periodic_loop.hpp"
#include "common/teleop/coupling/servo_side.hpp"

namespace phantom::runtime {

/// Logs changes of the link's state and of the enabling switch, a partner that has not confirmed a stop, and
/// a servo that is held up.
class LinkLogger {
 public:
  /// `partner`: in capitals, "THE SLAVE".
  explicit LinkLogger(std::string partner) : partner_(std::move(partner)) {}
  void update(const teleop::SideOutputs& now);

 private:
  std::string partner_;
  teleop::SideOutputs before_;
};

/// Logs why an actuator does not follow, whenever the reason changes.
class ActuatorLogger {
 public:
  void update(const core::ActuatorHealth& actuator);

 private:
  std::string logged_;
};

/// Returns one sentence on a starved loop: how often and for how long it was held up.
std::string held_up_sentence(const teleop::LoopPace& pace);

/// Returns `health` with the actuator's figures added. Trouble with the actuator, or with the servo that
/// moves it, replaces state and message.
core::Health with_actuator(core::Health health, const core::ActuatorHealth& actuator,
                           const teleop::SideOutputs& now);

/// Returns `health`, or a degraded one that reports why a stop cannot be kept at present. Empty: it can.
core::Health with_stop_trouble(core::Health health, const std::string& trouble);

/// Logs what the servo's thread was refused at its set-up, if anything.
void log_notice(const std::string& refused);

/// Runs a servo loop in a thread of its own. On request it runs an empty loop of the same period and
/// scheduling beside it, which shows the best that the host can do while the servo runs. Both end with the
/// process's stop request.
class ServoRunner {
 public:
  /// Starts the loops at once. `tick` must outlive the runner and be real-time safe.
  ServoRunner(double period_s, LoopScheduling scheduling, bool with_bare_loop,
              std::function<void(double dt_s)> tick)
      : servo_("servo", period_s, core::ThreadRole::kServo, scheduling),
        bare_("bare_loop", period_s, core::ThreadRole::kBareLoop, scheduling),
        tick_(std::move(tick)) {
    servo_thread_ = std::jthread([this] {
      servo_.run([this](double dt_s) {
        tick_(dt_s);
        return true;
      });
    });
    if (with_bare_loop) bare_thread_ = std::jthread([this] { bare_.run([](double) { return true; }); });
    with_bare_loop_ = with_bare_loop;
  }
  ServoRunner(const ServoRunner&) = delete;
  ServoRunner& operator=(const ServoRunner&) = delete;
  ~ServoRunner() { stop(); }

  /// Stops both loops and waits for their threads.
  void stop() {
    servo_.stop();
    bare_.stop();
    if (servo_thread_.joinable()) servo_thread_.join();
    if (bare_thread_.joinable()) bare_thread_.join();
  }
  /// Adds the thread to statistics(); it must outlive the runner.
  void watch(const core::Progress& thread) { watched_.push_back(&thread); }
  /// Returns the newest statistics of the servo, of the bare loop if it runs, and of the watched threads.
  /// Only one thread may call it.
  std::vector<core::LoopStatistics> statistics() {
    std::vector<core::LoopStatistics> all{servo_.statistics()};
    if (with_bare_loop_) all.push_back(bare_.statistics());
    for (const core::Progress* thread : watched_) all.push_back(thread->statistics());
    return all;
  }
  /// Returns once what the servo's thread was refused at its set-up; empty if nothing was (yet), or if it was
  /// returned before.
  std::string take_notice() {
    std::string notice = notice_taken_ ? std::string() : servo_.notice();
    notice_taken_ = notice_taken_ || !notice.empty();
    return notice;
  }

 private:
  PeriodicLoop servo_, bare_;
  std::function<void(double)> tick_;
  bool with_bare_loop_ = false, notice_taken_ = false;
  std::vector<const core::Progress*> watched_;
  std::jthread servo_thread_, bare_thread_;
};

struct ServoTiming {
  double period_s = 0.001;
  LoopScheduling scheduling;
  bool with_bare_loop = false;
};

/// Callbacks and threads that a side adds to the session of its servo.
template <class Report>
struct ServoCallbacks {
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
                                                    LinkLogger link_logger,
                                                    const ServoCallbacks<Report>& callbacks) {
  constexpr double kHealthPeriod_s = 0.5;
  std::mutex mutex;
  Report latest;  // guarded by the mutex
  core::Progress publishing("publisher");
  std::jthread publisher([&](const std::stop_token& stop) {
    core::apply_thread_config(core::ThreadRole::kPublisher, timing.scheduling.servo_priority);
    Report report;
    std::uint32_t signals = 0;
    while (!stop.stop_requested()) {
      publishing.tick();
      servo.published.wait(0.1);
      for (; signals != emergency_stop_signals(); ++signals) adapter.announce_stop("signal");
      if (!servo.outbox.read(report)) continue;
      adapter.publish(report);
      link_logger.update(report.outputs);
      if (callbacks.report) callbacks.report(report);
      const std::lock_guard lock(mutex);
      latest = report;
    }
  });
  ServoRunner loops(timing.period_s, timing.scheduling, timing.with_bare_loop,
                    [&servo](double dt_s) { servo.tick(dt_s, core::monotonic_ns()); });
  loops.watch(publishing);
  for (const core::Progress* thread : callbacks.watched) loops.watch(*thread);
  core::apply_thread_config(core::ThreadRole::kControl, timing.scheduling.servo_priority);
  ActuatorLogger actuators;
  const auto health = [&] {
    const core::ActuatorHealth driver = actuator.health();
    actuators.update(driver);
    const std::lock_guard lock(mutex);
    return with_stop_trouble(
        with_actuator(callbacks.health(latest, loops.statistics()), driver, latest.outputs), stops.trouble());
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
