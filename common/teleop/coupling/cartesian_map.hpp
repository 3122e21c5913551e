#pragma once

#include "common/core/joints.hpp"
#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::teleop {

using robot::Spatial;

/// Joint velocities (rows) per twist (columns), and by its transpose wrench per joint torques.
using JointMap = Eigen::Matrix<double, static_cast<int>(core::kMaxJoints), 6>;

/// What the damping of the inverse depends on.
struct CartesianMapParameters {
  std::size_t joint_count = 0;
  core::JointArray inertia{};  ///< of each joint of the virtual master, kg·m² or kg, > 0
  double mass_kg = 1.0;        ///< of the hand's device as seen at the tool, > 0
  double inertia_kg_m2 = 0.01;
  /// Gain of the inverse below which a direction counts as singular, 0…1: it is 1 ÷ the steepest that the
  /// joints may run for a tool that hardly moves.
  double singular_below = 0.2;
  bool orientation = true;  ///< false: the tool's orientation is left to itself
};

/// Inverse of the tool's Jacobian J, damped by singular value, and as much as the device's inertia asks for.
struct CartesianMap {
  JointMap joints_per_twist = JointMap::Zero();  ///< A: v = A·V
  /// Share of the hand's motion that the tool follows in the direction in which it follows least: 1 wherever
  /// J can be inverted, 0 where the arm has no such motion.
  double least_followed = 0.0;
};

/// Returns the damped inverse of `jacobian`. `weight` (0…1 by joint) takes joints out of use smoothly.
///
/// In coordinates scaled by the square roots of the inertias, J̃ = √M_t·J·√(w/m) = Σ σ u vᵀ. Its inverse is
/// Ã = Σ h(σ) v uᵀ with h = min(1/σ, 1, σ/singular_below):
///  - σ ≥ 1: the exact inverse of least kinetic energy;
///  - below: the tool moves less than the hand, so that ‖Ã‖ ≤ 1 everywhere. Then A·M_t⁻¹·Aᵀ ≤ M⁻¹: at no
///  joint and in
///    no pose, singular ones included, does the hand's device seem lighter than the inertia m with which
///    gains and damping limits of the joints are found stable;
///  - below singular_below: h falls to 0 in proportion, so that A is a Lipschitz function of the pose.
/// Sources: Nakamura and Hanafusa 1986, Maciejewski and Klein 1988 (damping by singular value), Chan and
/// Dubey 1995 (weights of the joints). Real-time safe: yes.
CartesianMap cartesian_map(const CartesianMapParameters& parameters, const robot::Jacobian& jacobian,
                           const core::JointArray& weight) noexcept;

}  // namespace phantom::teleop
