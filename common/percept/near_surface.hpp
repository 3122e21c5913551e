#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/workspace/workspace.hpp"

namespace phantom::percept {

/// The nearest voxel of a kind around a place.
struct NearVoxel {
  bool found = false;
  double distance_m = 0.0;                          ///< to the voxel's nearest point; 0: the place is in it
  Eigen::Vector3d way_m = Eigen::Vector3d::Zero();  ///< to that point
  std::uint16_t object = 0;                         ///< whose voxel it is; 0: nobody's
};

/// Farthest that near_surface() and near_free() look along each axis, in voxels.
inline constexpr int kMaxNearVoxels = 12;

/// Finds the nearest voxel of a body, its guard included, within `radius_m` of a place in the frame of the
/// workspace's grid. The radius is cut to kMaxNearVoxels voxels. Cost: one look-up for each voxel of that
/// cube. Real-time safe: yes.
NearVoxel near_surface(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                       double radius_m) noexcept;

/// Finds the nearest voxel that is in no body likewise; a guard is none.
NearVoxel near_free(const workspace::Workspace& workspace, const Eigen::Vector3d& position_m,
                    double radius_m) noexcept;

}  // namespace phantom::percept
