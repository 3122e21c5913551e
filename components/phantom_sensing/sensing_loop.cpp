#include "components/phantom_sensing/sensing_loop.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

#include "common/core/elapsed.hpp"
#include "common/core/thread_config.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr core::Nanoseconds kMaxWatchdog_ns = 10 * core::kNsPerMillisecond;
constexpr core::Nanoseconds kFiguresPeriod_ns = 400 * core::kNsPerMillisecond;

}  // namespace

SensingLoop::SensingLoop(const PhantomModel& model, const Config& config, WorkspaceSubscriber& workspace,
                         PerceptSink& sink, std::span<const OtherArm> other_arms)
    : config_(config),
      workspace_(workspace),
      sink_(sink),
      sensing_(model, config.percept),
      shares_(model.own_share ? std::span<const SkinShare>() : model.shares, config.share_wait_s),
      other_arms_(other_arms),
      staleness_ns_(core::from_seconds(config.staleness_s)),
      watchdog_ns_(std::min(kMaxWatchdog_ns, staleness_ns_ / 2)),
      // The worst sensor of a share belongs to its coefficients.
      percept_period_ns_(model.own_share ? 0 : core::from_seconds(1.0 / config.percept_rate_hz)),
      watch_(config.workspace_behind_after_s, config.workspace_stale_after_s) {
  sem_init(&wake_, 0, 0);
}

SensingLoop::~SensingLoop() { sem_destroy(&wake_); }

void SensingLoop::offer(const SlaveSample& sample) noexcept {
  inbox_.write(sample);
  sem_post(&wake_);
}

void SensingLoop::stop() noexcept {
  stop_.store(true, std::memory_order_relaxed);
  sem_post(&wake_);
}

void SensingLoop::run() {
  core::apply_thread_config(core::ThreadRole::kSensing, config_.servo_priority);
  progress_.begin();
  while (!stop_.load(std::memory_order_relaxed)) {
    const core::Nanoseconds until = core::monotonic_ns() + watchdog_ns_;
    const timespec due{until / core::kNsPerSecond, until % core::kNsPerSecond};
    while (sem_clockwait(&wake_, CLOCK_MONOTONIC, &due) != 0 && errno == EINTR) {
    }
    while (sem_trywait(&wake_) == 0) {
    }  // several states may have come; only the newest counts
    turn(core::monotonic_ns());
    progress_.tick();
  }
  progress_.end();
  publish_figures();
}

void SensingLoop::publish_figures() {
  counted_.tick_p50_us = 1e-3 * static_cast<double>(tick_times_.quantile_ns(0.5));
  counted_.tick_p99_us = 1e-3 * static_cast<double>(tick_times_.quantile_ns(0.99));
  counted_.tick_max_us = 1e-3 * static_cast<double>(tick_times_.max_ns());
  published_.write(counted_);
}

/// Returns what the states of other arms allow: their links are a part of what is around this arm. One that
/// has never come leaves them unknown; a stale one leaves them where they were, for as long as a workspace
/// that is behind is used.
PerceptCondition SensingLoop::assess_others(core::Nanoseconds now_ns) noexcept {
  PerceptCondition condition = PerceptCondition::kFresh;
  counted_.others_silent.reset();
  for (std::size_t i = 0; i < other_arms_.size(); ++i) {
    Other& other = others_[i];
    other.inbox.read(other.newest);
    const core::Nanoseconds age_ns = now_ns - other.newest.received_ns;
    if (other.newest.received_ns != 0 && age_ns <= staleness_ns_) continue;
    counted_.others_silent[i] = true;
    if (other.newest.received_ns == 0) return PerceptCondition::kNoWorkspace;
    const bool too_old = age_ns > staleness_ns_ + core::from_seconds(config_.workspace_stale_after_s);
    condition = too_old || condition == PerceptCondition::kWorkspaceStale
                    ? PerceptCondition::kWorkspaceStale
                    : PerceptCondition::kWorkspaceBehind;
  }
  return condition;
}

/// Returns where the links of the other arms are, and how they move: of a stale state, at rest.
std::span<const OtherLink> SensingLoop::place_others(core::Nanoseconds now_ns) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < other_arms_.size(); ++i) {
    const SlaveSample& state = others_[i].newest;
    const bool fresh = now_ns - state.received_ns <= staleness_ns_;
    other_arms_[i].put(state.position, fresh ? state.velocity : core::JointArray{},
                       std::span(other_links_).subspan(count, other_arms_[i].link_count()));
    count += other_arms_[i].link_count();
  }
  return std::span(other_links_).first(count);
}

/// Returns the most serious condition of state, workspace, other arms and self-test.
PerceptCondition SensingLoop::assess(std::uint64_t workspace_version, core::Nanoseconds now_ns) noexcept {
  const PerceptCondition workspace = watch_.assess(workspace_version, now_ns);
  const PerceptCondition others = assess_others(now_ns);
  if (!is_valid(workspace)) return workspace;
  if (!is_valid(others)) return others;
  if (!self_test_passed_.load(std::memory_order_relaxed)) return PerceptCondition::kSelfTestFailed;
  if (!counted_.state_seen) return PerceptCondition::kNoState;
  if (now_ns - newest_.received_ns > staleness_ns_) return PerceptCondition::kStateStale;
  return others != PerceptCondition::kFresh ? others : workspace;
}

void SensingLoop::turn(core::Nanoseconds now_ns) {
  const bool fresh = inbox_.read(newest_);
  if (fresh) counted_.state_seen = true;
  permits_inbox_.read(permits_);
  displaced_inbox_.read(displaced_);
  const SensedWorkspace workspace = workspace_.look();
  sensing_.set_active_skin(workspace.carrying);  // while the skin before is still there
  workspace_.release_older();
  watch_.announced(workspace_.announced());
  const PerceptCondition condition =
      assess(workspace.voxels != nullptr ? workspace.voxels->version : 0, now_ns);
  const bool valid = is_valid(condition);
  if ((fresh && valid) || (!valid && (outputs_.valid || now_ns - last_invalid_ns_ >= watchdog_ns_ / 2))) {
    tick(now_ns, workspace, condition);
  }
  if (now_ns >= next_figures_ns_) {
    next_figures_ns_ = now_ns + kFiguresPeriod_ns;
    publish_figures();
  }
}

double elapsed_s(const SlaveSample& before, const SlaveSample& sample) noexcept {
  if (sample.stamp.session != before.stamp.session || before.stamp.sequence_number == 0) return 0.0;
  return std::clamp(core::seconds(core::elapsed_ns(before.stamp.monotonic_ns, sample.stamp.monotonic_ns)),
                    0.0, 1.0);
}

FeltForce force_of(const messages::SlaveState& state) noexcept {
  FeltForce force;
  force.torques_known = state.force_measured;
  force.torque_Nm = state.external_torque_Nm;
  force.force_N = state.contact_force_N;
  force.contact = state.contact;
  force.known = state.force_measured || state.contact_force_N >= 0.0;
  force.located = state.contact && state.contact_force_N >= 0.0;
  force.point_W_m = messages::eigen(state.contact_point_m);
  return force;
}

Fingers fingers_of(const messages::GripperState& gripper) noexcept {
  if (!gripper.sense.known || !(gripper.widest_m > 0.0)) return {};
  return {.closed = 1.0 - std::clamp(gripper.sense.width_m / gripper.widest_m, 0.0, 1.0),
          .closing_per_s = -gripper.sense.velocity_m_s / gripper.widest_m};
}

bool is_current(const GripperSample& sample, core::Nanoseconds now_ns,
                core::Nanoseconds staleness_ns) noexcept {
  return sample.received_ns != 0 && now_ns - sample.received_ns <= staleness_ns && sample.sense.known;
}

/// Runs the step, with what the processes of the shares have sensed in time. While this process knows another
/// server's workspace or other contacts than theirs, it senses all.
void SensingLoop::sense(const StepInputs& inputs, const core::SampleId& gripper) {
  sensing_.begin(inputs, outputs_);
  SensedShares shares{};
  if (outputs_.valid && inputs.allowed == contacts_of_shares_ && !workspace_.contested())
    shares = shares_.await({newest_.stamp, gripper, outputs_.workspace_version, outputs_.drag_mode});
  counted_.shares_sensed_here += sensing_.end(inputs, shares, outputs_);
  counted_.shares_resting = shares_.resting();
}

void SensingLoop::tick(core::Nanoseconds now_ns, const SensedWorkspace& workspace,
                       PerceptCondition condition) {
  StepInputs inputs;
  inputs.workspace = workspace;
  inputs.state_valid = is_valid(condition);
  inputs.allowed = permits_.at(now_ns);
  inputs.displaced = displaced_;
  if (inputs.state_valid) {
    inputs.position = newest_.position;
    inputs.velocity = newest_.velocity;
    inputs.dt_s = elapsed_s(ticked_, newest_);
    inputs.others = place_others(now_ns);
    inputs.force = force_of(newest_);
    ticked_ = newest_;
  }
  gripper_inbox_.read(gripper_);
  core::SampleId gripper;
  if (is_current(gripper_, now_ns, staleness_ns_)) {
    inputs.fingers = fingers_of(gripper_);
    gripper = gripper_.stamp;
  }
  const core::Nanoseconds start_ns = core::monotonic_ns();
  sense(inputs, gripper);
  const core::Nanoseconds step_ns = core::monotonic_ns() - start_ns;
  if (outputs_.valid) {
    tick_times_.record(step_ns);
    ++counted_.ticks;
  } else {
    last_invalid_ns_ = now_ns;
    ++counted_.invalid_turns;
  }
  const double age_s = counted_.state_seen ? core::seconds(now_ns - newest_.received_ns) : 0.0;
  counted_.model_age_s = age_s;
  counted_.workspace_version = outputs_.workspace_version;
  counted_.greatest_neighbour_mu = workspace.greatest_neighbour_mu;
  counted_.active_sensors = outputs_.active_sensors;
  counted_.muted_sensors = outputs_.muted_sensors;
  counted_.outside = outputs_.outside;
  condition = with_doubts(condition, now_ns);
  counted_.condition = condition;
  publish(now_ns, {newest_, age_s, core::seconds(step_ns), condition, inputs.allowed.size(), gripper});
}

/// Returns the place that the percept is of; in free space that of the fastest interest point, which may come
/// into something first. At rest it is that of the one which was fastest last; of the arm's tip, if none has
/// moved yet or there is none.
const Eigen::Vector3d& SensingLoop::leading_place_W_m() noexcept {
  if (outputs_.percept.mu > 0.0) return outputs_.percept.position_W_m;
  constexpr double kRest_m_s = 0.002;
  double fastest_m_s = kRest_m_s;
  for (std::size_t i = 0; i < outputs_.interest.size(); ++i) {
    const double speed_m_s = outputs_.interest[i].velocity_W_m_s.norm();
    if (speed_m_s <= fastest_m_s) continue;
    fastest_m_s = speed_m_s;
    leading_point_ = i;
  }
  return leading_point_ < outputs_.interest.size() ? outputs_.interest[leading_point_].position_W_m
                                                   : outputs_.tip_W_m;
}

/// Marks what is fresh with what speaks against it. A workspace that is not current stays marked as that: it
/// may be why. The process of a share leaves it to the arm's.
PerceptCondition SensingLoop::with_doubts(PerceptCondition condition, core::Nanoseconds now_ns) noexcept {
  seen_inbox_.read(seen_);
  const bool unseen = config_.max_view_age_s > 0.0 && config_.own_share.empty() && outputs_.valid &&
                      seen_.is_unseen(leading_place_W_m(), config_.max_view_age_s, now_ns);
  const bool says_unseen = unseen_.step(unseen, now_ns);
  if (condition != PerceptCondition::kFresh) return condition;
  if (outputs_.model_in_doubt) return PerceptCondition::kModelInDoubt;
  return says_unseen ? PerceptCondition::kSpaceUnseen : condition;
}

void SensingLoop::publish(core::Nanoseconds now_ns, const TickInfo& info) {
  sink_.on_drag(outputs_, info);  // first, because the haptic loop waits for it
  if (now_ns >= next_percept_ns_) {
    const bool late = now_ns - next_percept_ns_ > percept_period_ns_;
    next_percept_ns_ = (late ? now_ns : next_percept_ns_) + percept_period_ns_;
    sink_.on_percept(outputs_, info);
  }
  for (const percept::Alert& alert : outputs_.alerts.cleared) sink_.on_alert(alert, true);
  for (const percept::Alert& alert : outputs_.alerts.raised) sink_.on_alert(alert, false);
  for (const percept::ModelDoubt& doubt : outputs_.doubts.ended) sink_.on_doubt(doubt, false);
  for (const percept::ModelDoubt& doubt : outputs_.doubts.raised) sink_.on_doubt(doubt, true);
}

LoopFigures SensingLoop::figures() {
  published_.read(read_);
  return read_;
}

}  // namespace phantom::phantom_sensing
