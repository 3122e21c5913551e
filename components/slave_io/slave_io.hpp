#pragma once

#include <cstdint>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/teleop/coupling/counterbalance.hpp"
#include "common/teleop/coupling/joint_servo.hpp"
#include "common/teleop/coupling/servo_side.hpp"
#include "common/teleop/guards/contact_force_limit.hpp"
#include "components/slave_io/config.hpp"

namespace phantom::slave_io {

/// The newest valid master_state.
using MasterSample = messages::Answer<messages::MasterState>;

struct SlaveInputs : teleop::SideInputs {
  MasterSample master;
  core::JointArray gravity_Nm{};   ///< torques that hold the weight; zero for a balanced arm
  bool counterbalance = false;     ///< an arm that is not balanced is to be counterbalanced automatically
  bool force_measured = false;     ///< external_Nm is known
  core::JointArray external_Nm{};  ///< F_e, of the tick before
  // Of the tick before, too.
  bool contact = false;
  double contact_force_N = -1.0;     ///< −1: not measured
  std::uint16_t contact_object = 0;  ///< 0: not known
};

struct SlaveOutputs : teleop::SideOutputs {
  std::int8_t far_joint =
      -1;  ///< index of a joint too far from the master's pose to align by itself; −1: none
  std::int8_t pressing_joint = -1;  ///< index of a joint that is held at its bound of contact force; −1: none
  bool pressing_tool = false;       ///< held by the bound at the tool
  bool pressing_object = false;     ///< held by what the touched object bears
  std::uint16_t pressed_object = 0;  ///< whose bound that is
  bool touches_it = false;           ///< false: it is not known what is touched, but may be that
  double pressing_effort = 0.0;      ///< of that joint, N·m or N; or at the tool, or on the object, N
  teleop::ServoTorque torque;
  core::JointArray weight_Nm{};  ///< part of the drives' torque that carries the weight, outside F_as
  teleop::Counterbalance counterbalance = teleop::Counterbalance::kMechanical;  ///< in force
  core::JointArray reference{};           ///< target of the position loops
  core::JointArray reference_velocity{};  ///< velocity of the reference, as far as the master reports it
};

/// The slave's controller: monitors the link, moves the reference, closes the position loops.
///
/// In states init, degraded and stopped it holds the position at which the state began. In states ready and
/// aligned it moves slowly to the master's pose if that is near, else it holds. In state coupled it follows
/// the master. While the drives do not follow, the reference is the arm's position, so that nothing jumps
/// when they do. Where the arm presses as hard as it may, its reference goes no farther (ContactForceLimit).
/// The drives get power once the master is heard and reports that it is not stopped. Joint positions, speeds
/// and torques stay within the arm's limits for any input.
class SlaveIo {
 public:
  /// `arm` must outlive the object. `latch` holds the stop that was in force when the previous process ended,
  /// if there was one.
  SlaveIo(const robot::SerialArm& arm, const Config& config, const core::JointArray& start_q,
          const teleop::StopLatch& latch);

  /// Takes where the objects with a bound are now. Real-time safe: yes.
  void place_objects(const BoundedPlaces& places) noexcept { bounds_.place(places); }
  /// Computes one tick. Has no side effects outside this object. Real-time safe: yes.
  SlaveOutputs step(const SlaveInputs& in, double dt_s) noexcept;

 private:
  core::JointArray lead_reference(const SlaveInputs& in, bool master_near, double dt_s) noexcept;
  teleop::ContactForce contact_force(const SlaveInputs& in) noexcept;
  void limit_speed(const core::JointArray& v, core::JointArray& drive_Nm) const noexcept;
  core::JointArray as_far_as_free(const SlaveInputs& in) const noexcept;
  std::int8_t far_joint(const core::JointArray& q) const noexcept;

  const robot::SerialArm& arm_;
  std::size_t count_;
  double tool_force_bound_N_;
  ForceBounds bounds_;
  std::uint16_t bounding_object_ = 0;  // whose bound was the last contact's; 0: nobody's
  core::JointArray lower_{}, upper_{}, max_speed_{};
  core::JointArray align_tolerance_, align_speed_, align_range_;
  teleop::LinkMonitor link_;
  teleop::JointServo servo_;
  teleop::GravityFeedForward weight_;
  teleop::ReferenceLimiter limiter_;
  teleop::ContactForceLimit contact_limit_;
};

}  // namespace phantom::slave_io
