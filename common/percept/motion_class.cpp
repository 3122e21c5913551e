#include "common/percept/motion_class.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::percept {

std::optional<double> approach_cosine(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                                      double least_speed_m_s) noexcept {
  const double reach = pgv_m.norm(), speed = velocity_m_s.norm();
  if (!(reach > 0.0) || !(speed > 0.0) || speed < least_speed_m_s) return std::nullopt;
  return std::clamp(pgv_m.dot(velocity_m_s) / (reach * speed), -1.0, 1.0);
}

MotionClass classify_motion(const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                            const MotionThresholds& thresholds) noexcept {
  const auto cosine = approach_cosine(pgv_m, velocity_m_s, thresholds.least_speed_m_s);
  if (!cosine) return MotionClass::kNone;
  const double angle = std::acos(*cosine);
  if (angle < thresholds.dangerous_below_rad) return MotionClass::kDangerous;
  if (angle > thresholds.safe_above_rad) return MotionClass::kSafe;
  return MotionClass::kNeutral;
}

}  // namespace phantom::percept
