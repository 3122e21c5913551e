#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/core/joints.hpp"
#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/simulation/joint_mechanics.hpp"
#include "common/simulation/yielding.hpp"

namespace phantom::simulation {

/// A body that nothing holds.
struct LooseBody {
  double mass_kg = 1.0;                                         ///< > 0
  Eigen::Vector3d centre_of_mass_m = Eigen::Vector3d::Zero();   ///< in the body's frame
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Identity();  ///< about that centre, along the frame's axes
  geometry::Pose X_WO;                                          ///< at the start
};

/// A point of body `a` that lies in the surface of body `b`, for one sub-step. The force on `a` is a spring
/// and a damper along the normal, which never pull, and friction of Coulomb's law.
struct Contact {
  std::size_t a = 0, b = 0;  ///< bodies, by Multibody's numbers
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  ///< unit vector out of `b`
  double depth_m = 0.0;                                 ///< > 0
  double stiffness_N_per_m = 30'000.0, damping_Ns_per_m = 100.0;
  double friction = 0.3;  ///< Coulomb's coefficient
  /// Velocity of `a`'s surface there beyond that of the body, as of a finger that moves in its link.
  Eigen::Vector3d surface_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_W_N = Eigen::Vector3d::Zero();  ///< on `a`; advance() fills it in
};

/// The equations of motion of a serial arm and loose bodies, coupled by their contacts.
///
/// MuJoCo solves them: mass matrix of the composite bodies, centrifugal and Coriolis forces, friction and
/// limits of joints and contacts as a convex problem by Newton's method (E. Todorov, Convex and
/// analytically-invertible dynamics with contacts and constraints, ICRA 2014), then the contacts' friction by
/// projected Gauss-Seidel. Where bodies touch is the caller's to say: MuJoCo knows meshes by their convex
/// hulls only. Steps are semi-implicit Euler. Bodies are numbered: 0 is the world and the arm's base; 1…n the
/// arm's links; then loose bodies.
class Multibody {
 public:
  /// Greatest number of contacts of a sub-step.
  static constexpr std::size_t kMaxContacts = 128;

  /// `joints`: friction and limits of the arm's joints (their inertia is not used); `rotor`: inertia of the
  /// drives seen at the joints, kg·m² or kg, which turn about their joints' axes only. Throws
  /// std::runtime_error if a value is not finite.
  Multibody(const robot::SerialArm& arm, const ArmMechanics& joints, const core::JointArray& rotor,
            const core::JointArray& start_q, const robot::Payload& payload, std::span<const LooseBody> loose,
            double sub_step_s);
  ~Multibody();
  Multibody(const Multibody&) = delete;
  Multibody& operator=(const Multibody&) = delete;

  std::size_t first_loose() const noexcept { return joint_count_ + 1; }

  /// Advances by the sub-step under the drives' torques (N·m or N) on the arm, the weight of the loose bodies
  /// (the arm's and the payload's are the caller's) and the contacts, whose forces are filled in. Contacts
  /// beyond kMaxContacts have no force. `yields`: what acts on the joints as they move, in an implicit step,
  /// so that no stiffness or damping is too much for it. A step that ends in numbers that are none is not
  /// made: everything stops where it is. Real-time safe: yes.
  void advance(const core::JointArray& torque_Nm, std::span<Contact> contacts,
               const JointYield& yields = {}) noexcept;

  /// Puts a payload on the arm's links, instead of the one so far. Real-time safe: yes.
  void carry(const robot::SerialArm& arm, const robot::Payload& payload) noexcept;
  /// Says whether a loose body rests: it has no weight, no speed and no contacts, so that it costs nothing.
  void rest(std::size_t loose, bool rests) noexcept { rests_[loose] = rests; }
  /// Changes the sub-step, > 0. Real-time safe: yes.
  void set_sub_step(double sub_step_s) noexcept;

  /// Motion of the joints, in rad or m. Real-time safe: yes, as what is below.
  double q(std::size_t joint) const noexcept;
  double v(std::size_t joint) const noexcept;
  /// Returns the pose in W of a body.
  geometry::Pose pose(std::size_t body) const noexcept;
  /// Returns how fast a loose body moves: its frame's origin in m/s plus its turning in rad/s times 0.1 m.
  double speed(std::size_t loose) const noexcept;
  /// Returns the kinetic energy of all, J. Real-time safe: no.
  double kinetic_J() const;

 private:
  struct World;
  void forces(const core::JointArray& torque_Nm) noexcept;
  void yield(const JointYield& yields) noexcept;
  void add(const Contact& contact) noexcept;
  void move_surfaces(std::span<const Contact> contacts) noexcept;
  void keep_finite() noexcept;

  std::unique_ptr<World> world_;
  std::size_t joint_count_;
  std::vector<LooseBody> loose_;
  std::vector<char> rests_;  // per loose body
};

}  // namespace phantom::simulation
