#pragma once

#include "common/geometry/mesh.hpp"

namespace phantom::geometry {

/// Closed meshes around the origin, triangles facing outwards. All lengths must be > 0.

/// Box with edges `size_m` along x, y, z.
TriangleMesh make_box(const Eigen::Vector3d& size_m);
/// Icosphere: 20·4^subdivisions triangles, vertices on the sphere; subdivisions 0…9.
TriangleMesh make_sphere(double radius_m, int subdivisions = 4);
/// Cylinder along z with flat ends at ±height/2; sides ≥ 3.
TriangleMesh make_cylinder(double radius_m, double height_m, int sides = 48);
/// Torus around z: ring radius from the axis to the tube's centre, tube radius; both counts ≥ 3.
TriangleMesh make_torus(double ring_radius_m, double tube_radius_m, int ring_sides = 64, int tube_sides = 32);

}  // namespace phantom::geometry
