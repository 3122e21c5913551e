#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>

#include "common/core/clock.hpp"
#include "common/core/histogram.hpp"
#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/messages/teleoperation.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_permits.hpp"
#include "components/phantom_sensing/other_arms.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"
#include "components/phantom_sensing/seen_space.hpp"
#include "components/phantom_sensing/workspace/share_inbox.hpp"
#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"
#include "components/phantom_sensing/workspace/workspace_watch.hpp"

namespace phantom::phantom_sensing {

/// A valid slave_state with the time at which it was received.
using SlaveSample = messages::Received<messages::SlaveState>;

/// A valid gripper_state with the time at which it was received.
using GripperSample = messages::Received<messages::GripperState>;

/// Returns where the fingers of a gripper are that reports so; at their widest if it does not know. Real-time
/// safe: yes.
Fingers fingers_of(const messages::GripperState& gripper) noexcept;
/// Returns whether a sample says where they are at `now_ns`. Real-time safe: yes.
bool is_current(const GripperSample& sample, core::Nanoseconds now_ns,
                core::Nanoseconds staleness_ns) noexcept;

/// Returns what the arm feels by its state. Real-time safe: yes.
FeltForce force_of(const messages::SlaveState& state) noexcept;

/// Returns the time between two states that are processed one after the other, by their writer's clock, so
/// that a replay gives the same value. Returns 0 for the first state and after a restart of the writer.
/// Real-time safe: yes.
double elapsed_s(const SlaveSample& before, const SlaveSample& sample) noexcept;

/// What is published in addition to the step's outputs.
struct TickInfo {
  SlaveSample slave;         ///< the state used by the tick; stamp 0: none has come yet
  double model_age_s = 0.0;  ///< time since the state was received
  double tick_s = 0.0;       ///< duration of the step
  PerceptCondition condition = PerceptCondition::kNoState;
  std::size_t allowed_contacts = 0;  ///< number of contacts allowed now
  core::SampleId gripper;  ///< the gripper_state used by it; 0: none, the fingers count as at their widest
};

/// Receives the loop's results. Called on the loop's thread, or on a thread of the sink that passes them on.
class PerceptSink {
 public:
  virtual ~PerceptSink() = default;
  virtual void on_drag(const StepOutputs& outputs, const TickInfo& info) = 0;
  virtual void on_percept(const StepOutputs& outputs, const TickInfo& info) = 0;
  virtual void on_alert(const percept::Alert& alert, bool cleared) = 0;
  /// A doubt of the model was raised, or no longer holds.
  virtual void on_doubt(const percept::ModelDoubt& /*doubt*/, bool /*holds*/) {}
};

/// Figures of the loop for the status; only the newest are kept.
struct LoopFigures {
  std::uint64_t ticks = 0;          ///< steps with a valid state and workspace
  std::uint64_t invalid_turns = 0;  ///< turns that published an invalid result
  double tick_p50_us = 0.0, tick_p99_us = 0.0, tick_max_us = 0.0;
  double model_age_s = 0.0;
  std::uint64_t workspace_version = 0;
  double greatest_neighbour_mu = 0.0;  ///< Pa·s/m, of that workspace
  std::size_t active_sensors = 0;
  std::size_t muted_sensors = 0;             ///< in the newest tick
  std::bitset<kMaxShares> shares_resting;    ///< shares that do not come in time, and are sensed here
  std::bitset<kMaxOtherArms> others_silent;  ///< other arms whose state is stale, or has never come
  std::uint64_t shares_sensed_here = 0;      ///< in all ticks, of shares that others sense
  bool outside = false;                      ///< StepOutputs::outside, in the newest tick
  bool state_seen = false;                   ///< a slave_state has come since the start
  PerceptCondition condition = PerceptCondition::kNoWorkspace;  ///< of the newest result
};

/// Runs one tick for each new slave_state and publishes its results; if several states have come, only the
/// newest counts. A watchdog on the monotonic clock makes the result invalid when the state is stale or there
/// is no usable workspace, from the start on: at most staleness + one watchdog period after the last sample,
/// and again every watchdog period. Every result states its condition (PerceptCondition).
class SensingLoop {
 public:
  /// All arguments must outlive this.
  SensingLoop(const PhantomModel& model, const Config& config, WorkspaceSubscriber& workspace,
              PerceptSink& sink, std::span<const OtherArm> other_arms = {});
  ~SensingLoop();

  /// Passes a new state to the loop. One thread. Real-time safe: yes.
  void offer(const SlaveSample& sample) noexcept;
  /// Passes a new state of the gripper to the loop. One thread. Real-time safe: yes.
  void offer(const GripperSample& sample) noexcept { gripper_inbox_.write(sample); }
  /// Reads the newest states, for another thread than the loop's: what did not come since the last call stays
  /// as it is. One thread. Real-time safe: yes.
  void newest(SlaveSample& slave, GripperSample& gripper) noexcept {
    inbox_.read<1>(slave);
    gripper_inbox_.read<1>(gripper);
  }
  /// Runs until stop() on the calling thread, to which it gives the name and priority of the sensing role.
  void run();
  void stop() noexcept;  ///< thread-safe
  /// Sets the contacts that are allowed from now on. One thread.
  void permit(const ContactPermits& permits) noexcept { permits_inbox_.write(permits); }
  /// Sets the objects that do not stand where the model has them. One thread.
  void know_displaced(const DisplacedObjects& objects) noexcept { displaced_inbox_.write(objects); }
  /// Sets how long ago depth cameras saw the workspace. One thread.
  void know_seen(const SeenSpace& seen) noexcept { seen_inbox_.write(seen); }
  /// Takes a state of another arm. Each arm's on one thread.
  void offer_other(std::size_t arm, const SlaveSample& sample) noexcept { others_[arm].inbox.write(sample); }
  /// Takes what the process of a share has published. Each share's on one thread.
  template <class Sample>
  void offer_share(std::size_t share, const Sample& sample) noexcept {
    shares_.offer(share, sample);
  }
  /// Sets the contacts that the processes of the shares know: theirs count while others hold nowhere. Before
  /// run().
  void expect_of_shares(const percept::AllowedContact& contacts) noexcept { contacts_of_shares_ = contacts; }
  /// Reports the outcome of the newest self-test: after a failed one there is no percept. Thread-safe.
  void self_tested(bool passed) noexcept { self_test_passed_.store(passed, std::memory_order_relaxed); }
  WorkspaceWatch& workspace_watch() noexcept { return watch_; }
  /// Performs one wake-up of run() at a given time; for tests.
  void turn(core::Nanoseconds now_ns);

  /// Returns the newest figures, at most half a second old. One reader thread.
  LoopFigures figures();
  /// Returns the progress of run(), which takes a turn at least once in a watchdog period. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  core::Nanoseconds watchdog_period_ns() const noexcept { return watchdog_ns_; }

 private:
  PerceptCondition assess(std::uint64_t workspace_version, core::Nanoseconds now_ns) noexcept;
  void sense(const StepInputs& inputs, const core::SampleId& gripper);
  PerceptCondition assess_others(core::Nanoseconds now_ns) noexcept;
  std::span<const OtherLink> place_others(core::Nanoseconds now_ns) noexcept;
  void tick(core::Nanoseconds now_ns, const SensedWorkspace& workspace, PerceptCondition condition);
  const Eigen::Vector3d& leading_place_W_m() noexcept;
  PerceptCondition with_doubts(PerceptCondition condition, core::Nanoseconds now_ns) noexcept;
  void publish(core::Nanoseconds now_ns, const TickInfo& info);
  void publish_figures();

  const Config& config_;
  WorkspaceSubscriber& workspace_;
  PerceptSink& sink_;
  PhantomSensing sensing_;
  ShareInbox shares_;
  /// Another arm, and its newest state.
  struct Other {
    core::Snapshot<SlaveSample> inbox;
    SlaveSample newest;
  };
  const std::span<const OtherArm> other_arms_;
  std::array<Other, kMaxOtherArms> others_;
  std::array<OtherLink, kMaxOtherLinks> other_links_;
  percept::AllowedContact contacts_of_shares_;
  core::Nanoseconds staleness_ns_, watchdog_ns_, percept_period_ns_;

  sem_t wake_;
  std::atomic<bool> stop_{false};
  // Read by the loop, and by newest().
  core::Snapshot<SlaveSample, 2> inbox_;
  core::Snapshot<GripperSample, 2> gripper_inbox_;
  core::Snapshot<ContactPermits> permits_inbox_;
  ContactPermits permits_;
  core::Snapshot<DisplacedObjects> displaced_inbox_;
  DisplacedObjects displaced_;
  core::Snapshot<SeenSpace> seen_inbox_;
  SeenSpace seen_;
  UnseenSpaceWatch unseen_;
  std::size_t leading_point_ =
      std::numeric_limits<std::size_t>::max();  // that was fastest last; max: none yet
  std::atomic<bool> self_test_passed_{true};
  WorkspaceWatch watch_;

  SlaveSample newest_, ticked_;
  GripperSample gripper_;
  StepOutputs outputs_;
  core::Nanoseconds last_invalid_ns_ = -core::kNsPerSecond, next_percept_ns_ = 0, next_figures_ns_ = 0;
  core::DurationHistogram tick_times_;
  core::Progress progress_{"sensing"};
  LoopFigures counted_, read_;
  core::Snapshot<LoopFigures> published_;
};

}  // namespace phantom::phantom_sensing
