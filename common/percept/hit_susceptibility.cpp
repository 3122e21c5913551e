#include "common/percept/hit_susceptibility.hpp"

#include <cmath>
#include <string>

namespace phantom::percept {

core::Status SpeedLimit::check() const {
  if (points < 1 || points > kMaxPoints) {
    return core::Status::invalid_argument("must have 1 to " + std::to_string(kMaxPoints) + " points");
  }
  for (std::size_t i = 0; i < points; ++i) {
    if (!(mu[i] >= 0.0) || !std::isfinite(mu[i]) || !(speed_m_s[i] >= 0.0) || !std::isfinite(speed_m_s[i])) {
      return core::Status::invalid_argument("point " + std::to_string(i) + ": μ and speed must be 0 or more");
    }
    if (i > 0 && !(mu[i] > mu[i - 1])) {
      return core::Status::invalid_argument("point " + std::to_string(i) +
                                            ": μ must rise from point to point");
    }
    if (i > 0 && speed_m_s[i] > speed_m_s[i - 1]) {
      return core::Status::invalid_argument("point " + std::to_string(i) +
                                            ": the speed must not rise with μ");
    }
  }
  return {};
}

double SpeedLimit::at(double mu_Pa_s_per_m) const noexcept {
  if (points == 0) return 0.0;
  if (mu_Pa_s_per_m <= mu[0]) return speed_m_s[0];
  for (std::size_t i = 1; i < points; ++i) {
    if (mu_Pa_s_per_m > mu[i]) continue;
    if (shape == LimitShape::kTable) return speed_m_s[i];
    const double t = (mu_Pa_s_per_m - mu[i - 1]) / (mu[i] - mu[i - 1]);
    return speed_m_s[i - 1] + t * (speed_m_s[i] - speed_m_s[i - 1]);
  }
  return speed_m_s[points - 1];
}

HitRule assess_hit(const HitSituation& situation, const HitThresholds& thresholds,
                   double speed_share) noexcept {
  if (!(situation.mu > 0.0)) return HitRule::kNone;
  if (situation.mu >= thresholds.mu_unsafe) return HitRule::kVeryClose;
  if (situation.speed_m_s <= speed_share * thresholds.limit.at(situation.mu)) return HitRule::kNone;
  if (situation.mu >= thresholds.mu_moderate) return HitRule::kModerateMoving;
  return situation.cosine && *situation.cosine > thresholds.cosine ? HitRule::kFarNearing : HitRule::kNone;
}

AlertEvents HitMonitor::close() noexcept {
  AlertEvents events;
  events.cleared = active_;
  active_.reset();
  rule_ = HitRule::kNone;
  quiet_s_ = 0.0;
  return events;
}

AlertEvents HitMonitor::step(const std::optional<HitCandidate>& candidate, double dt_s) noexcept {
  if (!(dt_s >= 0.0)) dt_s = 0.0;
  since_raise_s_ += dt_s;
  const double speed_share = active_ ? timing_.clear_speed_share : 1.0;
  rule_ = candidate ? assess_hit(candidate->situation, thresholds_, speed_share) : HitRule::kNone;
  AlertEvents events;
  if (rule_ == HitRule::kNone) {
    quiet_s_ += dt_s;
    if (active_ && quiet_s_ >= timing_.clear_after_s) events = close();
    return events;
  }
  quiet_s_ = 0.0;
  const bool graver = active_ && rule_ == HitRule::kVeryClose && active_->rule != HitRule::kVeryClose;
  if (active_ && !graver) return events;
  if (since_raise_s_ < timing_.least_interval_s) return events;
  events.cleared = active_;
  active_ = Alert{++raised_, rule_, *candidate};
  events.raised = active_;
  since_raise_s_ = 0.0;
  return events;
}

}  // namespace phantom::percept
