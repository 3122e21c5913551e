#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

namespace phantom::simulation {

/// What a point of the arm finds at its place in the real world.
struct ContactQuery {
  double distance_m = 1e9;  ///< to the nearest surface; negative inside
  Eigen::Vector3d normal_W =
      Eigen::Vector3d::Zero();  ///< unit vector away from the body; zero: not known here
  std::uint16_t object = 0;     ///< nearest body's id; 0: none near
};

/// The real bodies of the cell, as the simulated arm meets them.
class ContactWorld {
 public:
  virtual ~ContactWorld() = default;
  /// Signed distance of a point in W, which changes by no more than the way between two points; beyond
  /// range_m() any value ≥ range_m() may come. Real-time safe: yes.
  virtual double distance_m(const Eigen::Vector3d& p_W_m) const noexcept = 0;
  /// Everything about a point that is in touch or nearly so. Real-time safe: yes.
  virtual ContactQuery query(const Eigen::Vector3d& p_W_m) const noexcept = 0;
  /// Distance up to which distances are true, metres.
  virtual double range_m() const noexcept = 0;
};

/// A point of the arm's surface that can touch things, fixed to a link.
struct ContactPoint {
  std::size_t link = 0;                                  ///< index into SerialArm::links()
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the link's frame
};

}  // namespace phantom::simulation
