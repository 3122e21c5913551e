#pragma once

#include "common/core/joints.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// The momentum of a moving arm in joint coordinates, and the part of its change that no torque causes. With
/// the arm's equation of motion M(q)·v̇ + C(q,v)·v + g(q) = τ, where C is of Christoffel symbols so that
/// dM/dt = C + Cᵀ: dp/dt = τ − g + Cᵀ·v.
struct ArmMomentum {
  core::JointArray momentum{};  ///< p = M(q)·v; kg·m²/s of a revolute joint, kg·m/s of a prismatic one
  core::JointArray drift{};     ///< Cᵀ(q,v)·v = ∂(½vᵀMv)/∂q; N·m or N
};

/// Returns it for the links at `X_WL`, joint velocities `v` (rad/s or m/s) and the drives' inertias `rotor`
/// as seen at their joints (kg·m² or kg), which turn about their joints' axes only. `payload` moves with its
/// links. Base and gravity have no part in it. Cost: linear in the number of joints. Real-time safe: yes.
///
/// Source: R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 2 and 5 (spatial vectors, here all
/// in W about W's origin). p_j is the axis s_j on the momentum h of all that joint j carries. As a rigid body
/// turns with the joints before it, ∂(½vᵀMv)/∂q_j = h · (V_j × s_j), where V_j is the velocity of link j.
ArmMomentum momentum_of(const SerialArm& arm, const core::JointArray& rotor, const LinkPoses& X_WL,
                        const core::JointArray& v, const Payload& payload = {}) noexcept;

/// Fixes one more body to link `link`, with its centre of mass and its inertia about that in the link's
/// frame.
void add_body(Payload& payload, std::size_t link, double mass_kg, const Eigen::Vector3d& centre_m,
              const Eigen::Matrix3d& inertia_kg_m2);

/// Says that a body on link `link` takes up a volume of the fluid it is in, with its centre in the link's
/// frame.
void add_displaced(Payload& payload, std::size_t link, double volume_m3, const Eigen::Vector3d& centre_m);

/// Adds to `tau` the torques that hold the payload's weight (gravity along −z of W). Real-time safe: yes.
void add_weight(const SerialArm& arm, const Payload& payload, const LinkPoses& X_WL,
                core::JointArray& tau) noexcept;

}  // namespace phantom::robot
