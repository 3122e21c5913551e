#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace phantom::simulation {

/// Result of a query about a point in the real world.
struct ContactQuery {
  double distance_m = 1e9;                             ///< to the nearest surface; negative inside
  Eigen::Vector3d normal_W = Eigen::Vector3d::Zero();  ///< unit vector away from the body; zero: unknown
  std::uint16_t object = 0;                            ///< id of the nearest body; 0: none near
};

/// Interface to the real bodies of the cell for the simulated arm.
class ContactWorld {
 public:
  virtual ~ContactWorld() = default;
  /// Returns the signed distance of a point in W to the nearest surface. Between two points it changes by at
  /// most the distance between them. Beyond range_m() it may be any value ≥ range_m(). Real-time safe: yes.
  virtual double distance_m(const Eigen::Vector3d& p_W_m) const noexcept = 0;
  /// Returns all about a point that is in contact or nearly so. Real-time safe: yes.
  virtual ContactQuery query(const Eigen::Vector3d& p_W_m) const noexcept = 0;
  /// Likewise, of bodies that do not give way to the arm. Real-time safe: yes.
  virtual ContactQuery query_rigid(const Eigen::Vector3d& p_W_m) const noexcept { return query(p_W_m); }
  /// Returns the distance in metres up to which distance_m() is accurate.
  virtual double range_m() const noexcept = 0;
};

/// A point of the arm's surface that can make contact, fixed to a link.
struct ContactPoint {
  std::size_t link = 0;                                  ///< index into SerialArm::links()
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
  /// Its way in that frame until the gripper is closed, from its widest on, where `position_m` is.
  Eigen::Vector3d closing_m = Eigen::Vector3d::Zero();
};

}  // namespace phantom::simulation
