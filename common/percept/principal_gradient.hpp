#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/percept/allowed_contact.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::percept {

/// Which voxels of the (2m+1)³ zone count (shaping array type 1, thesis 6.2).
enum class ZoneShape { kCube, kSphere };

/// Where μ rises around a voxel (thesis 6.5).
struct PrincipalGradient {
  /// Vector P_L→P_H in metres, W axes, from the centroid of the zone's voxels of least μ to the centroid of
  /// those of greatest μ. It points towards the object. Zero if all μ are equal: no direction.
  Eigen::Vector3d pgv_W_m = Eigen::Vector3d::Zero();
  double strength = 0.0;               ///< PGS = |H − L| [Pa·s/m]
  double greatest = 0.0, least = 0.0;  ///< H and L [Pa·s/m]
  bool has_direction() const noexcept { return strength > 0.0 && pgv_W_m.squaredNorm() > 0.0; }
};

/// The zone of a cluster sensor: voxels that move with a point. Constant after construction.
class ClusterZone {
 public:
  /// `reach_vox` is m, 1…15. To find the gradient everywhere in a layer, 2m + 1 must exceed the layer's
  /// thickness.
  ClusterZone(int reach_vox, ZoneShape shape);
  std::size_t voxel_count() const noexcept { return voxels_; }
  /// Reads every voxel of the zone once, eight at a time where the zone is within the grid and `link` may
  /// touch nothing. Voxels outside the grid count as free space, and so do those whose object link `link` may
  /// touch. Real-time safe: yes.
  PrincipalGradient gradient(const workspace::Workspace& workspace, workspace::Index3 centre,
                             std::size_t link = 0, const AllowedContact& allowed = {}) const noexcept;

  /// Some of the zone's voxels, one after the other along x.
  struct Run {
    std::int32_t x, y, z;  ///< of the first, from the zone's centre
    std::uint32_t count;   ///< 1…8
  };

 private:
  int reach_vox_;
  std::size_t voxels_ = 0;
  std::vector<Run> runs_;
};

}  // namespace phantom::percept
