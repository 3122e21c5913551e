#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/drag/medium.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// A part of the space that a link takes up. It is lifted as an upright cube, whichever way the link turns:
/// in a surface by the share of its height that is below.
struct DisplacedPart {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< in the link's frame
  double volume_m3 = 0.0;                              ///< ≥ 0
  double height_m = 0.0;                               ///< of the cube, ≥ 0
};
using DisplacedParts = std::array<std::vector<DisplacedPart>, core::kMaxJoints + 1>;  ///< by link index

/// The lift of an arm in media that have a density: as much as the fluid weighs that it displaces
/// (Archimedes), at that fluid's centre. It depends on the pose alone, and stands in g(q) beside the weight.
/// Constant after construction; by default there is none, as in air.
class Buoyancy {
 public:
  Buoyancy() = default;
  Buoyancy(DisplacedParts parts, const Medium& medium);

  /// Whether a medium has a density.
  bool acts() const noexcept { return !medium_.empty(); }
  double volume_m3(std::size_t link) const noexcept { return whole_[link].volume_m3; }

  /// Adds to `tau` the torques (N·m or N) that hold the links against their lift: below zero where the weight
  /// has them above. A link wholly in one region costs as much as one part. Real-time safe: yes.
  void add_lift(const SerialArm& arm, const LinkPoses& X_WL, core::JointArray& tau) const noexcept;
  /// Adds those of what the arm carries, one cube for each link. Real-time safe: yes.
  void add_lift(const SerialArm& arm, const Payload& payload, const LinkPoses& X_WL,
                core::JointArray& tau) const noexcept;

 private:
  // All parts of a link as one, and the ball round its origin's frame that holds them.
  struct Whole {
    double volume_m3 = 0.0;
    Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero(), middle_m = Eigen::Vector3d::Zero();
    double radius_m = 0.0;
  };
  static Whole whole_of(const std::vector<DisplacedPart>& parts);
  double density_at(const Eigen::Vector3d& p_W_m) const noexcept;
  double displaced_kg(const DisplacedPart& part, const Eigen::Vector3d& centre_W_m) const noexcept;
  void lift_in_parts(const SerialArm& arm, std::size_t link, const LinkPoses& X_WL,
                     core::JointArray& tau) const noexcept;

  DisplacedParts parts_;
  std::array<Whole, core::kMaxJoints + 1> whole_{};
  Medium medium_;                  // regions that have a density
  std::vector<double> borders_m_;  // heights at which one begins or ends, rising
};

}  // namespace phantom::robot
