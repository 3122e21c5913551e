#pragma once

#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/jacobian.hpp"
#include "common/teleop/coupling/cartesian_map.hpp"
#include "common/teleop/coupling/ramp.hpp"

namespace phantom::teleop {

/// Which axes the hand's axes are laid on.
enum class HandFrame {
  kBase,  ///< of the arm's base
  kView,  ///< of the view that the operator looks at; without one, of the base
  kTool,  ///< of the tool
};

struct CartesianHandParameters {
  CartesianMapParameters
      map;  ///< with the hand's inertia as its device has it: the scales are taken into account
  core::JointArray max_speed{};  ///< greatest speed of each joint of the virtual master, rad/s or m/s, > 0
  double scale = 1.0;            ///< motion of the tool ÷ motion of the hand, > 0
  double rotation_scale = 1.0;
  HandFrame frame = HandFrame::kBase;
  Eigen::Matrix3d R_FD = Eigen::Matrix3d::Identity();  ///< the device's axes in that frame
  double clutch_fade_s = 0.15;                         ///< from out to fully in, and back, > 0
};

/// State of the device that the hand holds, in the device's axes.
struct HandState {
  geometry::Pose pose;
  Spatial twist = Spatial::Zero();  ///< of the handle: velocity of its origin, then its angular velocity
  bool clutch = false;              ///< in: the hand leads the tool
  bool valid = false;  ///< false: the device is not heard; as if it were at rest with its clutch out
};

/// A master that a Cartesian device moves: a virtual replica of the arm's joints, led by the hand's twist
/// through inverse kinematics, and the wrench that the hand feels of the joints' torques.
///
/// One linear map A = γ·s·A_t·K·R turns the hand's twist V into joint velocities v = A·V: rotation R into W,
/// scales K, damped inverse A_t (cartesian_map), speed share s (0…1) and clutch authority γ (0…1). The wrench
/// is its transpose, F = Aᵀ·τ. So F·V = τ·v at every tick, whatever A is: what is passive at the joints is
/// passive at the hand, at singularities and limits and while the clutch fades too. Away from those F =
/// J⁻ᵀ-mapped torques.
///
/// 1. The position never jumps: it changes by at most max_speed·dt, and never leaves the joints' limits.
/// 2. A joint's use falls towards its limits, and the others carry on. A joint that is too fast slows the
/// whole twist,
///    whose direction is kept.
/// 3. What the tool cannot follow is dropped (an implicit clutch), never wound up. What is lost by
/// integration is
///    worked off by pose, with a tenth of the joints' speed and no effect on the wrench.
/// 4. While the clutch is out nothing moves and F = 0. It fades in and out; the view is taken as the clutch
/// goes in. Pure. Real-time safe: yes.
class CartesianHand {
 public:
  /// `arm` must outlive the object.
  CartesianHand(const robot::SerialArm& arm, const CartesianHandParameters& parameters,
                const core::JointArray& start_q);

  /// Takes the hand's state of this tick. `R_WV`: axes of the view in W; null: unknown.
  void sense(const HandState& hand, const Eigen::Matrix3d* R_WV) noexcept;
  /// Returns the wrench on the hand, in the device's axes, of joint torques in this tick.
  Spatial wrench(const core::JointArray& torque_Nm) const noexcept;
  /// Moves on by `dt_s`. `lead`: the hand may lead the tool, since master and slave are coupled.
  void advance(bool lead, double dt_s) noexcept;
  /// Moves on by `dt_s` towards `target`, for a master that is not coupled; the clutch goes out.
  void meet(const core::JointArray& target, double dt_s) noexcept;

  const core::JointArray& position() const noexcept { return q_; }
  /// Velocities that the hand gives the joints in this tick: A·V, without what is worked off.
  const core::JointArray& velocity() const noexcept { return v_; }
  const geometry::Pose& tool_pose() const noexcept { return X_WT_; }
  /// Axes of the device in W in this tick.
  const Eigen::Matrix3d& rotation() const noexcept { return R_WD_; }
  const JointMap& map() const noexcept { return map_; }  ///< A
  double authority() const noexcept { return clutch_.value(); }
  double least_followed() const noexcept { return task_map_.least_followed; }
  /// Share of the hand's speed that the joints' greatest speeds allow in this tick.
  double speed_share() const noexcept { return speed_share_; }

 private:
  void look_at_pose() noexcept;
  Eigen::Matrix3d device_in_world(const Eigen::Matrix3d* R_WV) noexcept;
  double room(std::size_t joint, double velocity) const noexcept;
  double use(std::size_t joint) const noexcept;
  double share_of_speeds(const core::JointArray& v, double of) const noexcept;
  void move_reference(double dt_s) noexcept;
  core::JointArray correction() const noexcept;
  void move_joints(const core::JointArray& correction, double dt_s) noexcept;

  const robot::SerialArm& arm_;
  CartesianHandParameters parameters_;
  core::JointArray q_, v_{}, meeting_{};
  robot::Jacobian jacobian_;
  CartesianMap task_map_;
  JointMap map_ = JointMap::Zero();
  geometry::Pose X_WT_, reference_;
  HandState hand_;
  geometry::Pose last_pose_;
  bool had_pose_ = false;
  Eigen::Matrix3d R_WD_ = Eigen::Matrix3d::Identity(), R_WV_ = Eigen::Matrix3d::Identity();
  Spatial task_twist_ = Spatial::Zero();
  Ramp clutch_;
  double speed_share_ = 1.0, period_s_ = 0.001;
};

}  // namespace phantom::teleop
