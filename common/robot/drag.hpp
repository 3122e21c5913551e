#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"

namespace phantom::robot {

/// What the sensors of one link feel, as sums over sensors i of weight w_i, viscosity μ_i and offset d_i =
/// p_i − o from the link's origin o, in W axes: as if w·μ were mass, a mass, a first and a second moment
/// (spec 2.4). With the area as weight w·μ is in N·s/m.
struct ViscousSums {
  double mu = 0.0;                                            ///< Σ wμ
  Eigen::Vector3d mu_d = Eigen::Vector3d::Zero();             ///< Σ wμ d [m]
  Eigen::Matrix3d mu_dd = Eigen::Matrix3d::Zero();            ///< Σ wμ d dᵀ [m²]
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();         ///< Σ w∇μ [1/m]
  Eigen::Vector3d gradient_moment = Eigen::Vector3d::Zero();  ///< Σ d×(w∇μ) [1]
  double gradient_square = 0.0;                               ///< Σ w|∇μ|²/μ [1/m²]

  /// The same sums of the same sensors about the point o − offset (offset: from the new origin to the old
  /// one).
  void shift_by(const Eigen::Vector3d& offset_m) noexcept;
  void add(const ViscousSums& other) noexcept;
  void scale(double factor) noexcept;
};

/// Sums by link index (0 = base, unused).
using LinkSums = std::array<ViscousSums, core::kMaxJoints + 1>;

/// Directional drag: a link that nears is felt in full, one that leaves is let go.
///
/// A link is judged by the motion of all joints together. Over its sensors, moving with velocities u_i, let E
/// = Σ wμ|u_i|² (its share of vᵀDv), s = d(Σwμ)/dt = Σ w∇μ·u_i and Q = Σ w|∇μ|²/μ. By Cauchy and Schwarz |s|
/// ≤ √(Q·E), so σ = s/√(Q·E) lies in [−1, 1]: how squarely the link moves up the gradient. It keeps the share
/// h(σ) of its drag, with h(x) = 1 for x ≥ 0, falling to `leaving_share` at x ≤ −full_at by the smoothstep
/// x²(3−2x): continuous with its derivative, never above 1. Where the sum cancels (σ = 0: amid two objects,
/// or sliding along one) both directions keep the full drag.
///
/// With B_lk for link k's share of joint l's symmetric coefficient, B⁺_l = Σ_k h(σ_k)·B_lk, where joint l
/// moves forwards at its speed and the others as they do, and B⁻_l likewise backwards. So the coefficient
/// that holds for the sign of v_l is that of the motion at hand, and of a joint that moves alone both are
/// right whichever way it turns next. A joint that stands counts as if it crept at `still`. Going back the
/// way it came, a link that was felt in full is let go; one that the way back brings nearer to something is
/// felt.
struct DirectionalLaw {
  bool enabled = false;        ///< false: symmetric (thesis), B⁺ = B⁻ = B
  double leaving_share = 0.0;  ///< share of the drag that remains when leaving squarely, 0…1
  double full_at = 0.15;       ///< |σ| from which the share is fully applied, above 0…1
  double still = 0.005;        ///< rad/s or m/s, above 0: a motion this slow has no direction to speak of
};

/// Number of places of a packed lower triangle for kMaxJoints joints.
inline constexpr std::size_t kPackedMatrix = core::kMaxJoints * (core::kMaxJoints + 1) / 2;

/// Damping coefficients of a pose; N·m·s/rad (revolute), N·s/m (prismatic) when sensors are weighted by area.
struct DragCoefficients {
  core::JointArray plus{};   ///< B⁺, for v > 0
  core::JointArray minus{};  ///< B⁻, for v < 0
  core::JointArray sigma{};  ///< σ of the link that the joint carries; 0 if the law is off, or at rest
  /// Lower triangle of the coupled, symmetric, positive semi-definite matrix D, row by row: D(i,j) at
  /// i(i+1)/2 + j. Its diagonal is the symmetric coefficient B.
  std::array<double, kPackedMatrix> coupled{};

  friend bool operator==(const DragCoefficients&, const DragCoefficients&) = default;
  double matrix(std::size_t i, std::size_t j) const noexcept {
    return i >= j ? coupled[i * (i + 1) / 2 + j] : coupled[j * (j + 1) / 2 + i];
  }
};

/// Coefficients of every joint from the links' sums. Separable: B_l = aᵀJ_o a over all links ≥ l, the
/// thesis's Σ μ d_l² (eqs. 5.29–5.35, C.9–C.13); prismatic: Σμ. Coupled: D(q) = Σ JᵀJ wμ by the
/// composite-body algorithm. `X_WL` must be the pose at which the sums were taken; `v`, rad/s or m/s, is
/// looked at by the directional law alone. Real-time safe: yes.
void drag_coefficients(const SerialArm& arm, const LinkPoses& X_WL, const LinkSums& sums,
                       const DirectionalLaw& law, const core::JointArray& v,
                       DragCoefficients& result) noexcept;

/// Which torque the coefficients are to give. A drag_field carries it, so that the phantom's report and what
/// the master renders are the same law.
enum class DragMode {
  kSeparable,  ///< τ_l = −B±_l·v_l: each joint by itself (thesis)
  kCoupled  ///< τ = −S·D·S·v with S_l = √(B±_l / D_ll) for the direction of v_l (S = 1 when symmetric)
};

/// The law of drag, the only one: the phantom reports by it and the master renders by it. Torques at joint
/// velocities `v`: N·m or N. Never does positive work in either mode (coupled: if D is positive
/// semi-definite). Real-time safe: yes.
core::JointArray drag_torque(const DragCoefficients& drag, DragMode mode, const core::JointArray& v,
                             std::size_t joint_count) noexcept;

}  // namespace phantom::robot
