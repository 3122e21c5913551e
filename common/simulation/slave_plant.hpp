#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"
#include "common/simulation/contact_world.hpp"
#include "common/simulation/encoder.hpp"
#include "common/simulation/joint_mechanics.hpp"
#include "common/simulation/multibody.hpp"

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

/// Relative error by which the reported clearance may be too great. This tolerance saves nearly all look-ups.
inline constexpr double kClearanceTolerance = 0.04;

/// Contact as measured by an ideal force sensor and an ideal measuring machine.
struct ContactReport {
  bool contact = false;
  double force_N = 0.0;  ///< greatest force of a touching point
  std::uint16_t object = 0;
  Eigen::Vector3d point_W_m = Eigen::Vector3d::Zero();
  double clearance_m =
      -1.0;  ///< least distance of the arm's contact points, 0 in contact; −1: beyond the world's range
  core::JointArray joint_torque_Nm{};  ///< F_e: Jᵀf of all contact forces on the arm, averaged over the step
};

/// Simulates the slave arm: drives, inertia, friction, weight, end stops and contact with the real bodies.
///
/// The equations of motion are Multibody's: joints are coupled. Contact is a spring and damper at the deepest
/// points that only pushes, with friction. A step costs at most one distance look-up per contact point and a
/// few more for those that touch.
class SlavePlant {
 public:
  /// Greatest number of touching points that bear force at the same time; the deepest are chosen.
  static constexpr std::size_t kMaxTouching = 8;

  /// `arm` and `world` must outlive the plant. Throws std::runtime_error if the parameters make no arm.
  /// `tip_in_last_link_m`: the tool's tip in the last link's frame, for tool_speed_m_s().
  SlavePlant(const robot::SerialArm& arm, const SlavePlantParameters& parameters,
             std::vector<ContactPoint> points, const ContactWorld& world, const core::JointArray& start_q,
             const Eigen::Vector3d& tip_in_last_link_m);

  /// Advances by dt_s under the drives' torques. Torques that are not finite count as zero. Real-time safe:
  /// yes.
  void step(const core::JointArray& drive_Nm, double dt_s) noexcept;

  const core::JointArray& true_position() const noexcept { return q_; }
  const core::JointArray& true_velocity() const noexcept { return v_; }
  const core::JointArray& position() const noexcept { return encoders_.position(); }  ///< of the encoders
  const core::JointArray& velocity() const noexcept { return encoders_.velocity(); }
  const ContactReport& contact() const noexcept { return report_; }
  double tool_speed_m_s() const noexcept;
  /// Returns the torques that hold the weight at the present pose, for feed-forward; zero for a balanced arm.
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
  void take_weight() noexcept;
  void find_touching(double reach_m) noexcept;
  void keep_if_touching(std::size_t point, double distance_m, double reach_m) noexcept;
  double look_up(std::size_t point, const Eigen::Vector3d& p_W_m) noexcept;
  void find_contacts() noexcept;
  void report_contacts() noexcept;

  const robot::SerialArm& arm_;
  SlavePlantParameters parameters_;
  std::vector<ContactPoint> points_;  // sorted by link
  const ContactWorld& world_;
  Encoders encoders_;
  Eigen::Vector3d tip_m_;
  robot::LinkPoses X_WL_;
  core::JointArray q_, v_{}, gravity_Nm_{};
  Multibody dynamics_;
  std::vector<LastSeen> seen_;  // per point
  std::size_t nearest_ = 0;     // the point nearest to a body in the last scan
  std::array<Touching, kMaxTouching> touching_{};
  std::size_t touching_count_ = 0;
  std::array<Contact, kMaxTouching> contacts_;
  std::array<std::uint16_t, kMaxTouching> objects_{};  // of the contacts
  std::size_t contact_count_ = 0;
  ContactReport report_;
};

}  // namespace phantom::simulation
