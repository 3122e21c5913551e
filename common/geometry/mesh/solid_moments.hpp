#pragma once

#include <Eigen/Core>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Volume, centre and inertia of a solid of uniform density.
struct SolidMoments {
  double volume_m3 = 0.0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_m2 = Eigen::Matrix3d::Zero();  ///< of 1 kg, about the centre, along the mesh's axes
};

/// Returns those of the solid that a closed mesh encloses, by the divergence theorem over its triangles'
/// tetrahedra (Tonon, Explicit exact formulas for the 3-D tetrahedron inertia tensor, 2004); whichever way
/// they face. If it encloses nothing to speak of (it is open, a sheet), returns those of the box around it.
SolidMoments solid_moments(const TriangleMesh& mesh);

}  // namespace phantom::geometry
