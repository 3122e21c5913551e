#pragma once

#include <semaphore.h>

#include <atomic>
#include <cstdint>

#include "common/core/clock.hpp"
#include "common/core/histogram.hpp"
#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/messages/teleoperation.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_permits.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "components/phantom_sensing/workspace_keeper.hpp"
#include "components/phantom_sensing/workspace_watch.hpp"

namespace phantom::phantom_sensing {

/// The newest valid slave_state.
using SlaveSample = messages::Received<messages::SlaveState>;

/// Time between two states that are ticked one after the other, by their writer's clock, so that a replay
/// gives the same; 0 at the first and across a restart of the writer. Real-time safe: yes.
double elapsed_s(const SlaveSample& before, const SlaveSample& sample) noexcept;

/// What is published besides the step's outputs.
struct TickInfo {
  SlaveSample slave;         ///< that the tick rests on; stamp 0: none came yet
  double model_age_s = 0.0;  ///< time since it was received
  double tick_s = 0.0;       ///< time that the step took
  PerceptCondition condition = PerceptCondition::kNoState;
  std::size_t allowed_contacts = 0;  ///< that are allowed now
};

/// Takes what the loop makes. Called on the loop's thread, or on one that a sink before it has made.
class PerceptSink {
 public:
  virtual ~PerceptSink() = default;
  virtual void on_drag(const StepOutputs& outputs, const TickInfo& info) = 0;
  virtual void on_percept(const StepOutputs& outputs, const TickInfo& info) = 0;
  virtual void on_alert(const percept::Alert& alert, bool cleared) = 0;
};

/// How the loop does; published for the status, newest only.
struct LoopFigures {
  std::uint64_t ticks = 0;          ///< steps on a valid state and workspace
  std::uint64_t invalid_turns = 0;  ///< turns that had to publish an invalid result
  double tick_p50_us = 0.0, tick_p99_us = 0.0, tick_max_us = 0.0;
  double model_age_s = 0.0;
  std::uint64_t workspace_version = 0;
  double greatest_neighbour_mu = 0.0;  ///< Pa·s/m, of that workspace
  std::size_t active_sensors = 0;
  std::size_t muted_sensors = 0;                                ///< of the newest tick
  bool state_seen = false;                                      ///< a slave_state has come since the start
  PerceptCondition condition = PerceptCondition::kNoWorkspace;  ///< of the newest result
};

/// Turns every new slave_state into one tick and what it publishes; the newest state wins. A watchdog on the
/// monotonic clock makes the result invalid when the state is stale or there is no usable workspace, from the
/// start on: at most staleness + one watchdog period after the last sample, and again every watchdog period.
/// Every result says what it rests on (PerceptCondition).
class SensingLoop {
 public:
  /// All outlive this.
  SensingLoop(const PhantomModel& model, const Config& config, WorkspaceKeeper& workspace, PerceptSink& sink);
  ~SensingLoop();
  SensingLoop(const SensingLoop&) = delete;
  SensingLoop& operator=(const SensingLoop&) = delete;

  /// Gives it a state; one thread. Real-time safe: yes.
  void offer(const SlaveSample& sample) noexcept;
  /// Works until stop(), on the calling thread, which takes its place among the process's threads.
  void run();
  void stop() noexcept;  ///< thread-safe
  /// Contacts that are allowed from now on. One thread.
  void permit(const ContactPermits& permits) noexcept { permits_inbox_.write(permits); }
  /// Outcome of the newest self-test: after one that failed there is no percept. Thread-safe.
  void self_tested(bool passed) noexcept { self_test_passed_.store(passed, std::memory_order_relaxed); }
  WorkspaceWatch& workspace_watch() noexcept { return watch_; }
  /// One wake-up at a given time: what run() does, for tests.
  void turn(core::Nanoseconds now_ns);

  /// Newest figures, at most half a second old; one reader thread.
  LoopFigures figures();
  /// How run() gets on: it takes a turn at least once in a watchdog period. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  core::Nanoseconds watchdog_period_ns() const noexcept { return watchdog_ns_; }

 private:
  PerceptCondition assess(std::uint64_t workspace_version, core::Nanoseconds now_ns) noexcept;
  void tick(core::Nanoseconds now_ns, const SensedWorkspace& workspace, PerceptCondition condition);
  void publish(core::Nanoseconds now_ns, const TickInfo& info);
  void publish_figures();

  const Config& config_;
  WorkspaceKeeper& workspace_;
  PerceptSink& sink_;
  PhantomSensing sensing_;
  core::Nanoseconds staleness_ns_, watchdog_ns_, percept_period_ns_;

  sem_t wake_;
  std::atomic<bool> stop_{false};
  core::Snapshot<SlaveSample> inbox_;
  core::Snapshot<ContactPermits> permits_inbox_;
  ContactPermits permits_;
  std::atomic<bool> self_test_passed_{true};
  WorkspaceWatch watch_;

  SlaveSample newest_, ticked_;
  StepOutputs outputs_;
  core::Nanoseconds last_invalid_ns_ = -core::kNsPerSecond, next_percept_ns_ = 0, next_figures_ns_ = 0;
  core::DurationHistogram tick_times_;
  core::Progress progress_{"sensing"};
  LoopFigures counted_, read_;
  core::Snapshot<LoopFigures> published_;
};

}  // namespace phantom::phantom_sensing
