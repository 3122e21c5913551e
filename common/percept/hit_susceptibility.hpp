#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "common/core/status.hpp"
#include "common/percept/time_to_contact.hpp"

namespace phantom::percept {

/// The rule by which a hit threatens (thesis 6.8).
enum class HitRule {
  kNone,
  kVeryClose,       ///< rule 1: μ ≥ μ_unsafe, whatever the motion
  kModerateMoving,  ///< rule 2: μ_moderate ≤ μ < μ_unsafe and faster than the layer allows
  kFarNearing       ///< rule 3: 0 < μ < μ_moderate, faster than the layer allows, and towards the object
};

/// How a speed limit is interpolated between its points.
enum class LimitShape {
  kLinear,  ///< linearly (two points: the thesis's linear zone boundary)
  kTable    ///< the conservative look-up table of speed per layer: between two points the lower speed holds
};

/// Highest safe speed as a function of μ; constant before the first and after the last point.
struct SpeedLimit {
  static constexpr std::size_t kMaxPoints = 16;
  std::array<double, kMaxPoints> mu{};         ///< Pa·s/m, increasing
  std::array<double, kMaxPoints> speed_m_s{};  ///< never increasing: the closer, the slower
  std::size_t points = 0;
  LimitShape shape = LimitShape::kLinear;

  core::Status check() const;
  double at(double mu_Pa_s_per_m) const noexcept;  ///< real-time safe: yes
};

struct HitThresholds {
  double mu_unsafe = 32.0;    ///< Pa·s/m
  double mu_moderate = 13.0;  ///< Pa·s/m, above 0 and below mu_unsafe
  double cosine = 0.5;  ///< `Value` of the thesis: the cosine above which a far sensor counts as nearing
  SpeedLimit limit{{9.0, 32.0}, {0.10, 0.02}, 2};
};

/// Input of the rules: one sensor's μ and motion.
struct HitSituation {
  double mu = 0.0;
  double speed_m_s = 0.0;
  std::optional<double> cosine;  ///< of the angle between PGV and motion; none: no direction
};

/// Applies the rules of spec 2.5 (the inequality signs of the thesis's listing contradict its rules).
/// `speed_share` scales the speed limit. Real-time safe: yes.
HitRule assess_hit(const HitSituation& situation, const HitThresholds& thresholds,
                   double speed_share = 1.0) noexcept;

/// When alerts are raised and cleared.
struct AlertTiming {
  double clear_after_s = 0.5;      ///< an alert is cleared once no rule has held for this long
  double least_interval_s = 0.5;   ///< from one raised alert to the next of the same threat
  double clear_speed_share = 0.7;  ///< scales the speed limit while an alert is up (hysteresis)
};

/// A sensor to check, with everything that an alert latches.
struct HitCandidate {
  HitSituation situation;
  std::uint32_t link = 0;
  std::uint32_t sensor = 0;
  std::uint16_t object = 0;
  /// Index of the interest point that this sensor belongs to; −1: the whole skin.
  std::int32_t interest_point = -1;
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d pgv_W_m = Eigen::Vector3d::Zero();
  TimeToContact contact;
};

/// A raised alert. It is latched: the look-at point does not move until the next alert.
struct Alert {
  std::uint32_t number = 0;  ///< from 1
  HitRule rule = HitRule::kNone;
  HitCandidate at;
};

/// What changed in a step.
struct AlertEvents {
  std::optional<Alert> cleared;  ///< the alert that ended; comes before `raised`
  std::optional<Alert> raised;
};

/// Turns the rules for one threat, which is one link near one object, into alerts: raises, keeps and clears
/// them, with hysteresis and with a least interval between alerts. A new alert replaces the present one when
/// rule 1 sets in. Real-time safe: yes.
class HitMonitor {
 public:
  HitMonitor() = default;
  HitMonitor(const HitThresholds& thresholds, const AlertTiming& timing)
      : thresholds_(thresholds), timing_(timing) {}

  /// Takes the link's most urgent place near that object as `candidate`, or none (free space, or nothing
  /// known). A `dt_s` that is NaN or negative counts as 0.
  AlertEvents step(const std::optional<HitCandidate>& candidate, double dt_s) noexcept;
  /// Ends the present alert at once, because the data behind it are no longer valid.
  AlertEvents close() noexcept;

  const std::optional<Alert>& active() const noexcept { return active_; }
  HitRule rule() const noexcept { return rule_; }  ///< the rule that held in the last step
  /// Returns whether no alert is up and the next one may be raised at once.
  bool is_idle() const noexcept { return !active_ && since_raise_s_ >= timing_.least_interval_s; }

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
