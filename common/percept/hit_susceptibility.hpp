#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "common/core/status.hpp"

namespace phantom::percept {

/// Which rule says that a hit threatens (thesis 6.8).
enum class HitRule {
  kNone,
  kVeryClose,       ///< rule 1: μ ≥ μ_unsafe, whatever the motion
  kModerateMoving,  ///< rule 2: μ_moderate ≤ μ < μ_unsafe and faster than the layer allows
  kFarNearing       ///< rule 3: 0 < μ < μ_moderate, faster than the layer allows, and towards the object
};

/// How a speed limit goes between its points.
enum class LimitShape {
  kLinear,  ///< straight from point to point (two points: the thesis's linear zone boundary)
  kTable    ///< the conservative look-up table of speed per layer: between two points the slower one holds
};

/// Speed that is still safe, by μ; constant outside its points.
struct SpeedLimit {
  static constexpr std::size_t kMaxPoints = 16;
  std::array<double, kMaxPoints> mu{};         ///< Pa·s/m, rising
  std::array<double, kMaxPoints> speed_m_s{};  ///< not rising: the closer, the slower
  std::size_t points = 0;
  LimitShape shape = LimitShape::kLinear;

  core::Status check() const;
  double at(double mu_Pa_s_per_m) const noexcept;  ///< real-time safe: yes
};

struct HitThresholds {
  double mu_unsafe = 32.0;    ///< Pa·s/m
  double mu_moderate = 13.0;  ///< Pa·s/m, above 0 and below mu_unsafe
  double cosine = 0.5;        ///< `Value` of the thesis: how squarely a far sensor must near
  SpeedLimit limit{{9.0, 32.0}, {0.10, 0.02}, 2};
};

/// What the rules look at: one sensor's place and motion.
struct HitSituation {
  double mu = 0.0;
  double speed_m_s = 0.0;
  std::optional<double> cosine;  ///< between PGV and motion; none: no direction
};

/// The rules as in spec 2.5 (the inequality signs of the thesis's listing contradict its rules).
/// `speed_share` scales the speed limit. Real-time safe: yes.
HitRule assess_hit(const HitSituation& situation, const HitThresholds& thresholds,
                   double speed_share = 1.0) noexcept;

/// When alerts are raised and over.
struct AlertTiming {
  double clear_after_s = 0.5;     ///< an alert is over once no rule has held for so long
  double least_interval_s = 0.5;  ///< from one raise to the next
  double clear_speed_share =
      0.7;  ///< while an alert is up, speeds count against this share of the limit (hysteresis)
};

/// A sensor that is looked at, with all that an alert latches.
struct HitCandidate {
  HitSituation situation;
  std::uint32_t link = 0;
  std::uint32_t sensor = 0;
  std::uint16_t object = 0;
  std::int32_t interest_point = -1;  ///< index of the interest point that is looked at; −1: the whole skin
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d pgv_W_m = Eigen::Vector3d::Zero();
};

/// A raised alert, latched: the look-at point does not move until the next one.
struct Alert {
  std::uint32_t number = 0;  ///< from 1
  HitRule rule = HitRule::kNone;
  HitCandidate at;
};

/// What changed in a step.
struct AlertEvents {
  std::optional<Alert> cleared;  ///< this one is over; comes before `raised`
  std::optional<Alert> raised;
};

/// Turns rules into alerts: raises, keeps and clears, with hysteresis, and not more often than told. An alert
/// that is up is replaced when another link or object is threatened, or when rule 1 sets in. Real-time safe:
/// yes.
class HitMonitor {
 public:
  HitMonitor(const HitThresholds& thresholds, const AlertTiming& timing)
      : thresholds_(thresholds), timing_(timing) {}

  /// `candidate`: the worst sensor, or none (free space, or nothing known). A time that is no number counts
  /// as none.
  AlertEvents step(const std::optional<HitCandidate>& candidate, double dt_s) noexcept;
  /// Ends the alert that is up, at once: what it rests on is no longer known.
  AlertEvents close() noexcept;

  const std::optional<Alert>& active() const noexcept { return active_; }
  HitRule rule() const noexcept { return rule_; }  ///< that held in the last step

 private:
  HitThresholds thresholds_;
  AlertTiming timing_;
  std::optional<Alert> active_;
  HitRule rule_ = HitRule::kNone;
  std::uint32_t raised_ = 0;
  double quiet_s_ = 0.0;
  double since_raise_s_ = 1e9;
};

}  // namespace phantom::percept
