#pragma once

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Closed meshes around the origin, with triangles facing outwards. All lengths must be > 0.

/// Box with edges `size_m` along x, y, z.
TriangleMesh make_box(const Eigen::Vector3d& size_m);
/// Icosphere: 20·4^subdivisions triangles, vertices on the sphere; subdivisions 0…9.
TriangleMesh make_sphere(double radius_m, int subdivisions = 4);
/// Cylinder along z with flat ends at ±height/2; sides ≥ 3.
TriangleMesh make_cylinder(double radius_m, double height_m, int sides = 48);
/// Cone along z with its base (radius_m) at −height/2 and its top at +height/2. The top is flat with
/// top_radius_m, or a point if that is 0.
TriangleMesh make_cone(double radius_m, double top_radius_m, double height_m, int sides = 48);
/// Prism from a triangle in the plane z = 0 (corners counter-clockwise), extruded along z to ±height/2.
TriangleMesh make_prism(const std::array<Eigen::Vector2d, 3>& corners_m, double height_m);
/// Torus around z: ring radius from the axis to the tube's centre, tube radius; both counts ≥ 3.
TriangleMesh make_torus(double ring_radius_m, double tube_radius_m, int ring_sides = 64, int tube_sides = 32);

}  // namespace phantom::geometry
