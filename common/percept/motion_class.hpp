#pragma once

#include <Eigen/Core>
#include <optional>

namespace phantom::percept {

/// Unsafe motion detector (thesis 6.6.3): how a motion lies to the object's direction.
enum class MotionClass {
  kNone,      ///< no gradient or no motion: no direction
  kSafe,      ///< leaving
  kNeutral,   ///< neither
  kDangerous  ///< nearing
};

struct MotionThresholds {
  double dangerous_below_rad =
      1.0471975511965976;                      ///< angle between motion and PGV below which it nears (60°)
  double safe_above_rad = 2.0943951023931953;  ///< and above which it leaves (120°)
  double least_speed_m_s = 0.002;              ///< slower is no motion
};

/// Cosine of the angle Ψ between the motion and the PGV, −1…1; none without gradient or motion. Real-time
/// safe: yes.
std::optional<double> approach_cosine(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                                      double least_speed_m_s) noexcept;

/// Real-time safe: yes.
MotionClass classify_motion(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                            const MotionThresholds& thresholds) noexcept;

}  // namespace phantom::percept
