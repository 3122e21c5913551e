#pragma once

#include <Eigen/Core>

#include "common/workspace/workspace.hpp"

namespace phantom::percept {

/// How soon a place of the arm meets the object whose fluid it is in. −1 stands for what is not known.
struct TimeToContact {
  double time_s = -1.0;  ///< at the present closing speed; −1: the place does not near the object
  double error_s = -1.0;  ///< by how much the voxels may make it wrong, either way; −1: no surface was met on
                          ///< the way, and `time_s` is the earliest that the layers allow
  double gap_m = -1.0;  ///< distance to the object's surface along the gradient; −1: no surface was met
  bool is_nearing() const noexcept { return time_s >= 0.0; }

  friend bool operator==(const TimeToContact&, const TimeToContact&) = default;
};

/// Estimates the time to contact of a place: the way along the PGV, voxel by voxel, to the object's boundary,
/// over the speed along the PGV. All in the frame of the workspace's grid: `position_m`, which is in fluid,
/// `pgv_m`, and `velocity_m_s` relative to that fluid.
///
/// The speed counts as constant. A hand that brakes evenly comes later, or not at all, so the time is then
/// the earliest; one that speeds up by a (m/s²) comes up to a·t²/(2v) earlier. `error_s` is the share of the
/// voxels: the boundary is known to a diagonal of a voxel, and the PGV's direction to about a voxel in its
/// reach, which makes the way longer by a tenth at most on surfaces that are flat at that scale. Slower than
/// `least_speed_m_s` along the PGV is no nearing. Cost: one look-up for each voxel of the way, at most
/// kMaxSteps. Real-time safe: yes.
TimeToContact time_to_contact(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                              const Eigen::Vector3d& pgv_m, const Eigen::Vector3d& velocity_m_s,
                              double least_speed_m_s) noexcept;

}  // namespace phantom::percept
