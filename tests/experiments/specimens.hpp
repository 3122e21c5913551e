#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/geometry/implicit/implicit.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::experiments {

/// The specification's specimens: closed meshes, triangles facing outwards, in metres, around the origin with
/// their axis along z unless said otherwise.

/// Corners of the complex section, counter-clockwise: 56 of them on r(ψ) = r_0·(1 − depth·sin 3ψ), so three
/// convex lobes (out to `radius_m`) and three concave bays. Two lobes face −y with a bay between them, one
/// faces +y: what the tracks of figure 4.33 meet.
std::vector<Eigen::Vector2d> complex_section(double radius_m, double depth = 0.4);
/// The thesis's complex section cylinder: that section drawn out to a 56-gon prism of 220 triangles (2·56
/// sides, 2·54 in the ends).
geometry::TriangleMesh complex_cylinder(double radius_m, double height_m, double depth = 0.4);

/// A polygon without crossing edges, counter-clockwise, drawn out along z to ±height/2: 4n − 4 triangles.
geometry::TriangleMesh drawn_polygon(const std::vector<Eigen::Vector2d>& corners_m, double height_m);

/// The thesis's wedge (figure 4.11a): a block of `size_m` with a V groove along y in its upper face, as deep
/// and half as wide again as `groove_m` says (depth, width at the top). Its sides slope inwards by `taper_m`
/// from bottom to top along x.
geometry::TriangleMesh wedge_block(const Eigen::Vector3d& size_m, const Eigen::Vector2d& groove_m,
                                   double taper_m = 0.0);
/// Volume of the same, m³.
double wedge_volume_m3(const Eigen::Vector3d& size_m, const Eigen::Vector2d& groove_m, double taper_m = 0.0);

/// A tube with flat ends.
geometry::TriangleMesh hollow_cylinder(double outer_radius_m, double inner_radius_m, double height_m,
                                       int sides = 96);

/// The bar of 5 × 5 × 80 cm of figures 5.15 to 5.17, its length along x.
geometry::TriangleMesh bar();

/// `mesh` moved so that its origin is at `p_W_m`, turned by `yaw_rad` about z first.
geometry::TriangleMesh placed(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& p_W_m,
                              double yaw_rad = 0.0);

}  // namespace phantom::experiments
