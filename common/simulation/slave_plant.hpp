#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/simulation/contact_world.hpp"
#include "common/simulation/encoder.hpp"
#include "common/simulation/joint_mechanics.hpp"

namespace phantom::simulation {

struct SlavePlantParameters {
  ArmMechanics joints{};  ///< their inertia counts if there is no `rotor`
  /// Inertia of the drives seen at the joints, kg·m² or kg: a joint's inertia is this and that of the links
  /// beyond it at the present pose. None: constant, as `joints` has it.
  std::optional<core::JointArray> rotor;
  core::JointArray encoder_resolution{};  ///< rad or m per count
  double velocity_filter_s = 0.002;
  bool balanced = true;  ///< the weight is taken by counterweights; false: gravity acts on the joints
  double contact_stiffness_N_per_m = 30'000.0;  ///< per touching point
  double contact_damping_Ns_per_m = 100.0;  ///< likewise; acts only against further penetration's pressure
  int sub_steps = 4;                        ///< per step(), ≥ 1
};

/// Share by which the reported clearance may be too great: it saves nearly all look-ups.
inline constexpr double kClearanceTolerance = 0.04;

/// What an ideal force sensor and a measuring machine would say of the arm.
struct ContactReport {
  bool contact = false;
  double force_N = 0.0;  ///< greatest of the touching points'
  std::uint16_t object = 0;
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();
  double clearance_m =
      -1.0;  ///< least distance of the arm's contact points, 0 in touch; −1: farther than the world's range
  core::JointArray joint_torque_Nm{};  ///< F_e: Jᵀf of all contact forces on the arm, mean over the step
};

/// Reflected inertia of each joint, kg·m² or kg: the diagonal of the mass matrix at pose `q`, links as point
/// masses at their centres of mass, plus `rotor` inertia seen at the joint. Real-time safe: yes.
core::JointArray reflected_inertia(const robot::SerialArm& arm, const core::JointArray& q,
                                   const core::JointArray& rotor) noexcept;

/// Simulated slave arm: drives, inertia, friction, weight, end stops and contact with the real bodies.
///
/// Joint-wise dynamics, d(I·v)/dt = torque, with the diagonal I of the mass matrix at the present pose. The
/// matrix's other entries and the forces that go with speeds of other joints (centrifugal, Coriolis) are left
/// out: good for servo, feedback and contact at the speeds of telemanipulation, not for fast free motion.
/// Contact is a spring and damper at the deepest points, frictionless, pushing only. One step costs one
/// distance look-up per contact point and a few more for those that touch.
class SlavePlant {
 public:
  /// Touching points that bear force at the same time; deeper ones first.
  static constexpr std::size_t kMaxTouching = 8;

  /// `arm` and `world` must outlive the plant. `tip_link_frame`: frame of the tool in the last link, for
  /// tool_speed.
  SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
             std::vector<ContactPoint> points, const ContactWorld& world, const core::JointArray& start_q,
             const Eigen::Vector3d& tip_in_last_link_m);

  /// Advances by dt_s under the drives' torques. Torques that are not finite count as none. Real-time safe:
  /// yes.
  void step(const core::JointArray& drive_Nm, double dt_s) noexcept;

  const core::JointArray& true_position() const noexcept { return q_; }
  const core::JointArray& true_velocity() const noexcept { return v_; }
  const core::JointArray& position() const noexcept { return encoders_.position(); }  ///< as the encoders say
  const core::JointArray& velocity() const noexcept { return encoders_.velocity(); }
  const ContactReport& contact() const noexcept { return report_; }
  double tool_speed_m_s() const noexcept;
  /// Torques that hold the weight at the present pose; zero for a balanced arm. For feed-forward.
  const core::JointArray& gravity_Nm() const noexcept { return gravity_Nm_; }
  std::size_t contact_point_count() const noexcept { return points_.size(); }

 private:
  // Where a point was when its distance was last looked up: elsewhere it has changed by no more than the way.
  struct LastSeen {
    Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
    double distance_m = -1e9;  // at first: anything may be
  };
  struct Touching {
    std::size_t point = 0;
    double distance_m = 0.0;
  };
  void take_pose() noexcept;
  void find_touching(double reach_m) noexcept;
  void keep_if_touching(std::size_t point, double distance_m, double reach_m) noexcept;
  double look_up(std::size_t point, const Eigen::Vector3d& p_W_m) noexcept;
  void add_contact_torque(core::JointArray& torque_Nm) noexcept;

  const robot::SerialArm& arm_;
  SlavePlantParameters parameters_;
  std::vector<ContactPoint> points_;  // sorted by link
  const ContactWorld& world_;
  Encoders encoders_;
  Eigen::Vector3d tip_m_;
  robot::LinkPoses X_WL_;
  core::JointArray q_, v_{}, gravity_Nm_{};
  std::vector<LastSeen> seen_;  // per point
  std::size_t nearest_ = 0;     // point of the least distance in the last scan
  std::array<Touching, kMaxTouching> touching_{};
  std::size_t touching_count_ = 0;
  ContactReport report_;
};

}  // namespace phantom::simulation
