#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// Velocity of the places of a link of a moving arm, in W. It is linear in them. Real-time safe: yes.
struct PlaceVelocity {
  Eigen::Vector3d origin_W_m_s;      ///< of the link's origin
  Eigen::Vector3d angular_W_rad_s;   ///< ω
  Eigen::Matrix3d by_place_W_per_s;  ///< [ω]×·R_WL, times the place in the link's frame
  double turning_rad_s;              ///< |ω|

  /// Of a link at these poses, by the joints' velocities.
  PlaceVelocity(const SerialArm& arm, std::size_t link, const LinkPoses& X_WL,
                const core::JointArray& v) noexcept;
  /// Makes it relative to a body that moves with `linear_W_m_s` at `p_W_m`, and turns. `X_WL`: the link's.
  void relate_to(const Eigen::Vector3d& linear_W_m_s, const Eigen::Vector3d& body_angular_W_rad_s,
                 const Eigen::Vector3d& p_W_m, const geometry::Pose& X_WL) noexcept;
  Eigen::Vector3d at(const Eigen::Vector3d& p_L_m) const noexcept {
    return origin_W_m_s + by_place_W_per_s * p_L_m;
  }
  /// Returns a bound of the speed within a sphere.
  double greatest_within(const Eigen::Vector3d& p_L_m, double radius_m) const noexcept {
    return at(p_L_m).norm() + turning_rad_s * radius_m;
  }

 private:
  void turn(const Eigen::Matrix3d& R_WL) noexcept;
};

/// Which speed is too high for a sensor, by the code of the fluid that it meets. Real-time safe: yes.
class CodeSpeedLimits {
 public:
  /// `limit_of(mu)`: the limit in m/s; negative: a sensor in that fluid is looked at whatever its speed.
  template <class LimitOf>
  CodeSpeedLimits(std::span<const float> palette, const LimitOf& limit_of) {
    limit_m_s_.fill(-1.0);
    for (std::size_t code = 1; code < std::min(palette.size(), limit_m_s_.size()); ++code)
      limit_m_s_[code] = limit_of(static_cast<double>(palette[code]));
    least_m_s_ = limit_m_s_;
    for (std::size_t code = 2; code < least_m_s_.size(); ++code)
      least_m_s_[code] = std::min(least_m_s_[code], least_m_s_[code - 1]);
  }
  /// Returns whether a sensor may exceed the limit of its code, above 0. `speed_squared_m2_s2`: of its place
  /// on the link; `more_m_s`: it may be faster than that by so much.
  bool exceeds(std::uint8_t code, double speed_squared_m2_s2, double more_m_s) const noexcept {
    const double limit_m_s = limit_m_s_[code] - more_m_s;
    return limit_m_s < 0.0 || speed_squared_m2_s2 > limit_m_s * limit_m_s;
  }
  /// Returns whether a sensor of that speed keeps the limit of its code.
  bool holds(std::uint8_t code, double speed_m_s) const noexcept { return speed_m_s <= limit_m_s_[code]; }
  /// Returns whether no sensor of that speed exceeds the limit in fluid of a code up to this one.
  bool none_exceeds(std::uint8_t code, double speed_m_s) const noexcept {
    return speed_m_s <= least_m_s_[code];
  }

 private:
  std::array<double, 256> limit_m_s_, least_m_s_;
};

}  // namespace phantom::robot
