#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/link_mesh.hpp"

namespace phantom::robot {

enum class JointType { kRevolute, kPrismatic };

/// A moving joint of the chain. By type, units are rad or m, rad/s or m/s, N·m or N.
struct Joint {
  std::string name;
  JointType type = JointType::kRevolute;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit vector, in the joint's frame
  /// Joint frame at q = 0 in the previous moving link's frame (fixed joints folded in).
  geometry::Pose X_parent_joint;
  double lower = 0.0, upper = 0.0;  ///< −∞ and ∞ for a continuous joint
  double max_speed = 0.0, max_effort = 0.0;

  /// Returns the motion about or along the axis to position `q`. Real-time safe: yes.
  geometry::Pose motion(double q) const noexcept;
};

/// A moving link: the URDF link that a joint carries, and all links that are fixed to it or hang on a held
/// joint. Index 0 is the base, which does not move; link i follows joint i−1.
struct Link {
  std::string name;  ///< URDF name of the link that the joint carries
  std::vector<std::pair<std::string, geometry::Pose>> frames;  ///< every URDF link in it, with X_link_frame
  std::vector<LinkMesh> meshes;                                ///< what is seen of it
  double mass_kg = 0.0;
  Eigen::Vector3d centre_of_mass_m = Eigen::Vector3d::Zero();  ///< in this link's frame
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();     ///< about the centre of mass, along its axes

  /// Fixes a body to the link: its centre of mass and its inertia about that, both in this link's frame.
  void add_body(double body_kg, const Eigen::Vector3d& centre_m, const Eigen::Matrix3d& body_kg_m2);
};

/// Order of the four elementary motions in a row of a DH table. z and x are the axes of the moving frame.
enum class DhConvention {
  kClassic,  ///< Denavit and Hartenberg: Rz(θ)·Tz(d)·Tx(a)·Rx(α); joint i moves about z of frame i−1
  kModified  ///< Craig: Rx(α)·Tx(a)·Rz(θ)·Tz(d), with a and α of the previous link; joint i moves about z of
             ///< frame i
};

/// One row of a DH table: a joint and the link it carries. The joint's position is added to θ (revolute) or d
/// (prismatic), so that the table's value is the offset at q = 0.
struct DhRow {
  std::string link;   ///< name of the row's frame, unique in the table and not "base"
  std::string joint;  ///< empty: named "joint_" and the row's number from 1
  JointType type = JointType::kRevolute;
  double theta_rad = 0.0, d_m = 0.0, a_m = 0.0, alpha_rad = 0.0;
  double lower = 0.0, upper = 0.0;           ///< rad or m; −∞ and ∞ for a joint without limits
  double max_speed = 0.0, max_effort = 0.0;  ///< above 0; rad/s or m/s, N·m or N
  double mass_kg = 0.0;                      ///< of the carried link
  Eigen::Vector3d centre_of_mass_m = Eigen::Vector3d::Zero();  ///< in the row's frame
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();     ///< about that centre, along the row's axes
};

/// Returns whether `inertia_kg_m2` may be that of a body: finite, symmetric, no principal moment below zero.
bool is_inertia(const Eigen::Matrix3d& inertia_kg_m2);

/// What stands instead of values in a URDF's `<limit>`, by joint: rad, rad/s and N·m, or m, m/s and N.
/// Vendors' files have an effort of 0, or none, and soft limits that are narrower.
struct JointLimits {
  std::map<std::string, double> lower, upper, max_speed, max_effort;
};

/// Poses of the links in the workspace frame, by link index (0 = base).
using LinkPoses = std::array<geometry::Pose, core::kMaxJoints + 1>;

inline constexpr double kGravity_m_s2 = 9.80665;  ///< standard gravity, along −z of W

/// Kinematics of a serial arm. Constant after loading.
class SerialArm {
 public:
  /// Reads the chain from the URDF's root to `tip_link`. `X_WB` is the pose of the base link in the workspace
  /// frame. Moving joints off the chain (a gripper's fingers, another branch) are held: at the position that
  /// `held` states by the joint's name (rad or m), else at 0 or the limit nearest to it; a joint that mimics
  /// another follows it; planar and floating joints stay at their origin. Boxes, cylinders and spheres become
  /// meshes; a link without a visual is seen as its collision geometry. find_mesh() finds the files.
  /// notices() has what was decided. Errors name the file, the link or joint, and what is allowed: a joint of
  /// the chain that mimics another or whose type is not revolute, continuous or prismatic, more than 16 of
  /// them, a missing mesh file, a missing limit, a stated position of no held joint or outside of its
  /// limits, an inertia that no body has. `limits` stand instead of the file's; they may name moving joints
  /// of the chain only.
  static core::Expected<SerialArm> from_urdf(const std::filesystem::path& urdf, const std::string& tip_link,
                                             const geometry::Pose& X_WB,
                                             const std::map<std::string, double>& held = {},
                                             const JointLimits& limits = {});

  /// Builds the chain of a DH table, in the order of its rows (thesis eq. 2.2: A_1(q_1)…A_n(q_n)). Frame
  /// "base" is the parent of the first row, at `X_WB`. find_frame() finds each row's frame by its link's
  /// name. A moving link's own frame lies on its joint's axis; with kClassic that is not the row's frame.
  /// Errors name the row and what is allowed: 1 to 16 rows, finite numbers, limits in order, speeds and
  /// efforts above 0, unique names.
  static core::Expected<SerialArm> from_dh(const std::vector<DhRow>& rows, DhConvention convention,
                                           const geometry::Pose& X_WB);

  std::size_t joint_count() const noexcept { return joints_.size(); }
  const std::vector<Joint>& joints() const noexcept { return joints_; }
  const std::vector<Link>& links() const noexcept { return links_; }
  const geometry::Pose& base_pose() const noexcept { return X_WB_; }
  /// Returns what from_urdf() decided where the file leaves a choice, or left out: one sentence each.
  const std::vector<std::string>& notices() const noexcept { return notices_; }
  /// Returns the index of the moving link that holds the URDF or DH link `name`, and the pose of that frame
  /// in it.
  std::optional<std::pair<std::size_t, geometry::Pose>> find_frame(const std::string& name) const;

  /// Returns the start and end point of a moving link's axis, in the link's frame. The start (LASP) is the
  /// origin of the link's joint; for link 0 that of the base frame. The end (LAEP) is the origin of the next
  /// joint; for the last link that of the tip frame.
  std::pair<Eigen::Vector3d, Eigen::Vector3d> link_axis_m(std::size_t link) const;

  /// Computes X_WL of every link (forward kinematics, thesis eq. 2.2) for `q` in rad or m. Real-time safe:
  /// yes.
  void link_poses(const core::JointArray& q, LinkPoses& X_WL) const noexcept;
  /// Joint axis as a unit vector, and a point on it, in W. Real-time safe: yes.
  Eigen::Vector3d axis_W(std::size_t joint, const LinkPoses& X_WL) const noexcept;
  Eigen::Vector3d axis_point_W(std::size_t joint, const LinkPoses& X_WL) const noexcept;
  /// Returns the velocity in W of a point fixed to link `link`, now at `p_W_m`. Real-time safe: yes.
  Eigen::Vector3d point_velocity_W(std::size_t link, const Eigen::Vector3d& p_W_m, const LinkPoses& X_WL,
                                   const core::JointArray& v) const noexcept;
  /// Adds to `tau` the joint torques (N·m or N) of a force `f_W_N` that acts on link `link` at `p_W_m` (Jᵀf).
  /// Real-time safe: yes.
  void add_force(std::size_t link, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& f_W_N,
                 const LinkPoses& X_WL, core::JointArray& tau) const noexcept;
  /// Adds those of a torque `torque_W_Nm` on link `link`, wherever it acts. Real-time safe: yes.
  void add_torque(std::size_t link, const Eigen::Vector3d& torque_W_Nm, const LinkPoses& X_WL,
                  core::JointArray& tau) const noexcept;
  /// Returns the torques that balance the arm's weight (gravity along −z of W). Real-time safe: yes.
  core::JointArray gravity_torque(const LinkPoses& X_WL) const noexcept;

 private:
  geometry::Pose X_WB_;
  std::vector<Joint> joints_;
  std::vector<Link> links_;
  std::vector<std::string> notices_;
  Eigen::Vector3d tip_m_ = Eigen::Vector3d::Zero();  // origin of the tip frame in the last link's frame
};

}  // namespace phantom::robot
