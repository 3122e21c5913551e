#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/drag/buoyancy.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/simulation/contact_world.hpp"
#include "common/simulation/encoder.hpp"
#include "common/simulation/gripper_plant.hpp"
#include "common/simulation/joint_mechanics.hpp"
#include "common/simulation/loose_objects.hpp"
#include "common/simulation/multibody.hpp"
#include "common/simulation/yielding.hpp"

namespace phantom::simulation {

struct SlavePlantParameters {
  ArmMechanics joints{};                  ///< friction and limits; inertia is that of the links and `rotor`
  core::JointArray rotor{};               ///< inertia of the drives seen at the joints, kg·m² or kg; > 0
  core::JointArray encoder_resolution{};  ///< rad or m per count
  double velocity_filter_s = 0.002;
  bool balanced = true;     ///< counterweights balance the weight; false: gravity acts on the joints
  robot::LoadBody payload;  ///< on the last link, of which the arm's model knows nothing; its weight acts on
                            ///< a balanced arm, too
  double contact_stiffness_N_per_m = 30'000.0;  ///< per touching point
  double contact_damping_Ns_per_m = 100.0;      ///< per touching point; the total force never pulls
  double contact_friction = 0.2;                ///< Coulomb's coefficient, ≥ 0
  int sub_steps = 4;                            ///< per step(), ≥ 1
};

/// What the arm may take in its world.
struct Handling {
  std::optional<GripperPlantParameters> gripper;  ///< its fingers are the arm's contact points that close
  double pad_friction = 0.6;                      ///< Coulomb's coefficient of the fingers, ≥ 0
  std::vector<LooseObject> loose;
};

/// Relative error by which the reported clearance may be too great. This tolerance saves nearly all look-ups.
inline constexpr double kClearanceTolerance = 0.04;

/// Contact as measured by an ideal force sensor and an ideal measuring machine: of the arm, and of what its
/// fingers hold between them, with everything else. What they hold is as the arm's own.
struct ContactReport {
  bool contact = false;
  double force_N = 0.0;  ///< greatest force of a touching point, or of a soft body on a link
  std::uint16_t object = 0;
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();
  double clearance_m = -1.0;  ///< least distance of the arm's contact points from fixed bodies, 0 in contact;
                              ///< −1: beyond the world's range
  core::JointArray joint_torque_Nm{};  ///< F_e: Jᵀf of all forces on the arm from outside, of contacts, soft
                                       ///< bodies and fluids, averaged over the step
};

/// Simulates the slave arm: drives, inertia, friction, weight, end stops and contact with the real bodies,
/// and loose objects that it pushes, grips and drops.
///
/// The equations of motion are Multibody's: joints are coupled. Contact is a spring and damper at the deepest
/// points that only pushes, with friction. A step costs at most one distance look-up per contact point and a
/// few more for those that touch. Fingers have the one coordinate of GripperPlant; the forces on them are
/// those on its width by the principle of virtual work, and the arm's link bears the rest.
class SlavePlant {
 public:
  /// Greatest number of touching points that bear force at the same time; the deepest are chosen.
  static constexpr std::size_t kMaxTouching = 8;

  /// `arm` and `world` must outlive the plant. Throws std::runtime_error if the parameters make no arm.
  /// `tip_in_last_link_m`: the tool's tip in the last link's frame, for tool_speed_m_s(). `yielding`: what
  /// gives way round the arm; null: nothing does. `buoyancy`, which must outlive it, too: lifts links and
  /// payload, also of a balanced arm, whose counterweights are in air; null: nothing is lifted. Loose objects
  /// are not.
  SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
             std::vector<ContactPoint> points, const ContactWorld& world, const core::JointArray& start_q,
             const Eigen::Vector3d& tip_in_last_link_m, const Handling& handling = {},
             std::unique_ptr<Yielding> yielding = nullptr, const robot::Buoyancy* buoyancy = nullptr);

  /// Advances by dt_s under the drives' torques. Torques that are not finite count as zero. Real-time safe:
  /// yes.
  void step(const core::JointArray& drive_Nm, double dt_s) noexcept;

  /// Puts on the arm what it carries besides `parameters.payload` and what its fingers hold, with its weight.
  /// Real-time safe: yes.
  void carry(const robot::Payload& payload) noexcept;
  /// Commands the gripper's drive, until the next command. Real-time safe: yes.
  void grip(double demand_m, double greatest_force_N) noexcept {
    demand_m_ = demand_m;
    greatest_force_N_ = greatest_force_N;
  }
  /// Returns the gripper; null: the arm has none.
  const GripperPlant* gripper() const noexcept { return gripper_ ? &*gripper_ : nullptr; }
  const LooseObjects& loose() const noexcept { return loose_; }
  /// Returns where a loose object is. Real-time safe: yes.
  geometry::Pose pose_of_loose(std::size_t object) const noexcept {
    return dynamics_.pose(dynamics_.first_loose() + object);
  }
  /// Returns whether the fingers hold a loose object between them. Real-time safe: yes.
  bool holds(std::size_t object) const noexcept { return held_s_[object] > 0.0; }

  const core::JointArray& true_position() const noexcept { return q_; }
  const core::JointArray& true_velocity() const noexcept { return v_; }
  const core::JointArray& position() const noexcept { return encoders_.position(); }  ///< of the encoders
  const core::JointArray& velocity() const noexcept { return encoders_.velocity(); }
  const ContactReport& contact() const noexcept { return report_; }
  double tool_speed_m_s() const noexcept;
  /// Returns the torques that hold the links' weight, and hold them down against their lift, at the present
  /// pose, for feed-forward; of a balanced arm those against the lift alone.
  const core::JointArray& gravity_Nm() const noexcept { return gravity_Nm_; }
  std::size_t contact_point_count() const noexcept { return points_.size(); }

 private:
  // Position and distance of a point at its last look-up. Since then the distance has changed by at most the
  // distance moved.
  struct LastSeen {
    Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
    double distance_m = -1e9;  // initially unknown, so any distance is possible
  };
  struct Touching {
    std::size_t point = 0;
    double distance_m = 0.0;
  };
  // A contact of contacts_: with which of the arm's points, and with which loose objects; −1: with none.
  struct Meeting {
    std::int32_t arm_point = -1, loose_a = -1, loose_b = -1;
    std::uint16_t object = 0;  // whose surface it is
  };
  void take_weight() noexcept;
  Eigen::Vector3d place_W_m(const ContactPoint& point) const noexcept;
  void add_contact(const Contact& contact, const Meeting& meeting) noexcept;
  void find_loose_contacts() noexcept;
  void move_fingers(double sub_step_s) noexcept;
  bool as_on_arm(const Meeting& meeting, double& sign, std::uint16_t& object) const noexcept;
  void find_touching(double reach_m) noexcept;
  void keep_if_touching(std::size_t point, double distance_m, double reach_m) noexcept;
  double look_up(std::size_t point, const Eigen::Vector3d& p_W_m) noexcept;
  void find_contacts() noexcept;
  void report_contacts() noexcept;
  void report_yielding() noexcept;

  const robot::SerialArm& arm_;
  SlavePlantParameters parameters_;
  std::vector<ContactPoint> points_;  // sorted by link
  const ContactWorld& world_;
  Encoders encoders_;
  Eigen::Vector3d tip_m_;
  robot::LinkPoses X_WL_;
  core::JointArray q_, v_{}, gravity_Nm_{};
  LooseObjects loose_;
  std::optional<GripperPlant> gripper_;
  double pad_friction_, demand_m_ = 0.0, greatest_force_N_ = 0.0, closed_share_ = 0.0;
  std::vector<double> held_s_;                    // per loose object, for how long it still counts as held
  std::vector<std::array<double, 2>> pressed_N_;  // per loose object, by either finger
  Eigen::Vector3d closing_m_ = Eigen::Vector3d::Zero();  // of one finger; the other's is opposite
  std::size_t hand_ = 0;                                 // the fingers' link
  robot::Payload load_;
  Multibody dynamics_;
  std::unique_ptr<Yielding> yielding_;
  const robot::Buoyancy* buoyancy_;
  std::vector<ArmPoint> arm_points_;  // where points_ are
  std::vector<LastSeen> seen_;        // per point
  std::size_t nearest_ = 0;           // the point nearest to a body in the last scan
  std::array<Touching, kMaxTouching> touching_{};
  std::size_t touching_count_ = 0;
  std::array<Contact, Multibody::kMaxContacts> contacts_;
  std::array<Meeting, Multibody::kMaxContacts> met_;  // of the contacts
  std::size_t contact_count_ = 0;
  ContactReport report_;
};

}  // namespace phantom::simulation
