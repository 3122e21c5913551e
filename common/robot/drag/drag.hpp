#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// Sums over the sensors of one link, with weight w_i, viscosity μ_i and offset d_i = p_i − o from the link's
/// origin o, in W axes. If w·μ were a mass, they would be the mass and its first and second moments (spec
/// 2.4). With the area as weight, w·μ is in N·s/m.
struct ViscousSums {
  double mu = 0.0;                                            ///< Σ wμ
  Eigen::Vector3d mu_d = Eigen::Vector3d::Zero();             ///< Σ wμ d [m]
  Eigen::Matrix3d mu_dd = Eigen::Matrix3d::Zero();            ///< Σ wμ d dᵀ [m²]
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();         ///< Σ w∇μ [1/m]
  Eigen::Vector3d gradient_moment = Eigen::Vector3d::Zero();  ///< Σ d×(w∇μ) [1]
  double gradient_square = 0.0;                               ///< Σ w|∇μ|²/μ [1/m²]

  /// Moves the reference point from o to o − `offset_m`; the offset points from the new origin to the old
  /// one.
  void shift_by(const Eigen::Vector3d& offset_m) noexcept;
  void add(const ViscousSums& other) noexcept;
  void scale(double factor) noexcept;
  /// Returns the sums in the axes of another frame; `rotation` turns into those.
  ViscousSums turned(const Eigen::Matrix3d& rotation) const noexcept;
};

/// Sums for each link index (0 = base, unused).
using LinkSums = std::array<ViscousSums, core::kMaxJoints + 1>;

/// Directional drag: a link that approaches an object keeps its full drag, and a link that leaves it keeps
/// only `leaving_share` of it.
///
/// The law looks at each link's motion under all joints together. Its sensors move with velocities u_i. Let E
/// = Σ wμ|u_i|² (the link's share of vᵀDv), s = d(Σwμ)/dt = Σ w∇μ·u_i and Q = Σ w|∇μ|²/μ. By the
/// Cauchy–Schwarz inequality |s| ≤ √(Q·E), so σ = s/√(Q·E) lies in [−1, 1]. σ says how squarely the link
/// moves up the gradient. The link keeps the share h(σ) of its drag. h(x) is 1 for x ≥ 0 and falls to
/// `leaving_share` at x ≤ −full_at by the smoothstep x²(3−2x); h and its derivative are continuous and h is
/// never above 1. Where the sum cancels (σ = 0: between two objects, or sliding along one), both directions
/// keep the full drag.
///
/// Let B_lk be link k's share of joint l's symmetric coefficient. Then B⁺_l = Σ_k h(σ_k)·B_lk, with σ_k
/// computed for joint l moving forwards at its speed and the other joints as they move; B⁻_l likewise for
/// joint l moving backwards. So the coefficient for the sign of v_l is that of the present motion. For a
/// joint that moves alone, both coefficients are right whichever way it turns next. A joint at rest counts as
/// moving at the speed `still`. When the arm reverses, a link that had full drag loses it, and a link that
/// now approaches something gets its full drag.
struct DirectionalLaw {
  bool enabled = false;        ///< false: symmetric (thesis), B⁺ = B⁻ = B
  double leaving_share = 0.0;  ///< share of the drag that remains when moving straight away, 0…1
  double full_at = 0.15;       ///< |σ| from which only leaving_share remains, above 0, at most 1
  double still = 0.005;        ///< rad/s or m/s, above 0; at this speed a motion has no clear direction
};

/// Number of elements of a packed lower triangle for kMaxJoints joints.
inline constexpr std::size_t kPackedMatrix = core::kMaxJoints * (core::kMaxJoints + 1) / 2;

/// Damping coefficients at a pose: N·m·s/rad (revolute), N·s/m (prismatic) when sensors are weighted by area.
struct DragCoefficients {
  core::JointArray plus{};   ///< B⁺, for v > 0
  core::JointArray minus{};  ///< B⁻, for v < 0
  core::JointArray sigma{};  ///< σ of the link that the joint carries; 0 if the law is off, or at rest
  /// Lower triangle of the coupled matrix D, which is symmetric and positive semi-definite, row by row:
  /// D(i,j) is at i(i+1)/2 + j. Its diagonal holds the symmetric coefficients B.
  std::array<double, kPackedMatrix> coupled{};
  /// Velocity, rad/s or m/s, with which the joints would drift in the current of a medium (medium.hpp); 0: it
  /// stands still. The drag is that of the velocity relative to it, as far as drag_torque() says.
  core::JointArray drift{};

  friend bool operator==(const DragCoefficients&, const DragCoefficients&) = default;
  double matrix(std::size_t i, std::size_t j) const noexcept {
    return i >= j ? coupled[i * (i + 1) / 2 + j] : coupled[j * (j + 1) / 2 + i];
  }
};

/// Computes the coefficients of every joint from the links' sums. Separable: B_l = aᵀJ_o a over all links ≥
/// l, the thesis's Σ μ d_l² (eqs. 5.29–5.35, C.9–C.13); prismatic: Σμ. Coupled: D(q) = Σ JᵀJ wμ by the
/// composite-body algorithm. `X_WL` must be the pose at which the sums were taken. Only the directional law
/// uses `v` (rad/s or m/s). Real-time safe: yes.
void drag_coefficients(const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
                       const DirectionalLaw& law, const core::JointArray& v,
                       DragCoefficients& result) noexcept;

/// Fluid that moves as a rigid body does, and what links feel of it: a point p of it has the velocity
/// linear + angular × (p − origin), in W.
struct MovingSums {
  const LinkSums* sums = nullptr;
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero(), linear_m_s = Eigen::Vector3d::Zero(),
                  angular_rad_s = Eigen::Vector3d::Zero();
};

/// Lets go of joints that give way to a fluid that moves. Drag answers the skin's speed relative to the
/// fluid: τ_l = −B_l·(v_l − w_l), where w_l = f_l/B_l is the joint speed at which the flow carries it along,
/// and f_l the sum of wμ·u_f over its links' sensors, about the joint's axis. Rendered is what resists: B±_l
/// is multiplied by clamp(1 − (±w_l)/max(|v_l|, still), 0, 1). So a joint that gives way as fast as the flow,
/// or more slowly, is free; one that goes against it keeps its full drag; and one at rest is not pushed. B±
/// never rises, so drag stays dissipative. Real-time safe: yes.
void relieve_by_flow(const SerialArm& arm, const LinkPoses& X_WL, std::span<const MovingSums> fluids,
                     double still, const core::JointArray& v, DragCoefficients& result) noexcept;

/// How torque follows from the coefficients. Each drag_field message carries the mode, so that the phantom
/// reports the same law that the master renders.
enum class DragMode {
  kSeparable,  ///< τ_l = −B±_l·r_l: each joint for itself (thesis)
  kCoupled  ///< τ = −S·D·S·r with S_l = √(B±_l / D_ll) for the direction of v_l (S = 1 when symmetric)
};

/// Returns the drag torque at joint velocities `v`, in N·m or N. The phantom's report and the master's
/// rendering both use this function. Never does positive work in either mode (coupled: if D is positive
/// semi-definite). Real-time safe: yes.
///
/// Without a current r = v. In a current c (`drift`) the full relative velocity v − c would push an arm at
/// rest. So r = v − s·c with s = min(1, |v|/|c|), joint by joint, or, coupled, in the norm |x|² = xᵀ·S·D·S·x.
/// Then v and r never point apart (Cauchy–Schwarz): the drag takes energy or none, is zero at rest and
/// continuous, and from |v| = |c| on it is that of the relative velocity. Slower, it is twice the medium's
/// own against the current, and none with it.
core::JointArray drag_torque(const DragCoefficients& drag, DragMode mode, const core::JointArray& v,
                             std::size_t joint_count) noexcept;

}  // namespace phantom::robot
