#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::voxelise {

/// What of a solid lies in one cell of a coarse grid.
struct SolidPiece {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  ///< of its volume
  double volume_m3 = 0.0;                              ///< > 0
  double cell_m = 0.0;                                 ///< side of a cube as large as the cell
};

struct SolidPieces {
  std::vector<SolidPiece> pieces;  ///< none: the mesh encloses nothing
  bool closed = true;              ///< false: the mesh has gaps, which voxelise() closed
};

/// Divides the solid that a mesh encloses, in the mesh's frame and by voxelise()'s rules, into up to eight
/// cells along its longest side and cells of about that size along the others. Volumes are counted in
/// 64 voxels along each side: exact for an upright box, within 1 % for round bodies (tested). Errors as
/// voxelise(). Pure; not real-time safe.
core::Expected<SolidPieces> solid_pieces(const geometry::TriangleMesh& mesh);

}  // namespace phantom::voxelise
