#pragma once

#include <Eigen/Core>
#include <optional>

namespace phantom::percept {

/// How a motion is directed relative to an object, as found by the unsafe motion detector (thesis 6.6.3).
enum class MotionClass {
  kNone,      ///< no direction, because there is no gradient or no motion
  kSafe,      ///< leaving
  kNeutral,   ///< neither leaving nor nearing
  kDangerous  ///< nearing
};

struct MotionThresholds {
  // Limits of the angle between motion and PGV.
  double dangerous_below_rad = 1.0471975511965976;  ///< below it the motion is nearing (60°)
  double safe_above_rad = 2.0943951023931953;       ///< above it the motion is leaving (120°)
  double least_speed_m_s = 0.002;                   ///< a slower motion counts as none
};

/// Returns the cosine, −1…1, of the angle Ψ between the motion and the PGV, or none without gradient or
/// motion. Real-time safe: yes.
std::optional<double> approach_cosine(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                                      double least_speed_m_s) noexcept;

/// Classifies a motion by its angle to the PGV. Real-time safe: yes.
MotionClass classify_motion(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                            const MotionThresholds& thresholds) noexcept;

}  // namespace phantom::percept
