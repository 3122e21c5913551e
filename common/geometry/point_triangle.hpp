#pragma once

#include <Eigen/Core>

namespace phantom::geometry {

/// Returns the point of the triangle (a, b, c) nearest to `p`, all in one frame. Degenerate triangles are
/// treated as segments or points. Real-time safe: yes. (Voronoi regions of vertices and edges, Ericson 2005,
/// 5.1.5.)
Eigen::Vector3d closest_point_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b, const Eigen::Vector3d& c);
Eigen::Vector3f closest_point_on_triangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                          const Eigen::Vector3f& b, const Eigen::Vector3f& c);

/// Returns the point of the segment (a, b) nearest to `p`. Real-time safe: yes.
Eigen::Vector3d closest_point_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                         const Eigen::Vector3d& b);

}  // namespace phantom::geometry
