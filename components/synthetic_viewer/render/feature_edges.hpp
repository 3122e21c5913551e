#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "components/synthetic_viewer/render/frame.hpp"

namespace phantom::synthetic_viewer {

/// The edges of a mesh, for drawing it as lines. Constant once made.
struct EdgeMesh {
  struct Edge {
    std::array<std::uint32_t, 2> ends;   ///< indices into places_m
    std::array<std::uint32_t, 2> sides;  ///< the triangles beside it; the same twice at a border
    bool feature;                        ///< sharp, a border, or where more than two triangles meet
  };
  std::vector<Eigen::Vector3f> places_m;
  std::vector<Eigen::Vector3f> normals;  ///< of each triangle, not zero
  std::vector<Edge> edges;
  std::vector<std::uint32_t> corners;  ///< places at which features meet from directions not in one plane
};

/// Returns the edges of a mesh; those that bend by more than `sharp_rad` are features. Vertices at one place
/// count as one; triangles without area are left out. Pure.
EdgeMesh edges_of(const geometry::TriangleMesh& mesh, double sharp_rad = 0.5);

/// Returns the corner of a mesh that a person would name by three signs: of those in that eighth of its
/// bounding box, the one nearest to the box's own corner. `high`: by axis, whether it is the one with the
/// greater coordinate. Nothing if there is none in that eighth. Pure.
std::optional<Eigen::Vector3f> corner_towards(const EdgeMesh& mesh, const std::array<bool, 3>& high);

/// Appends the features and the silhouette of a body as seen from `eye_m` (in W), hidden ones, too.
void add_edges(const EdgeMesh& mesh, const geometry::Pose& X_WM, const Eigen::Vector3d& eye_m,
               std::vector<Line>& lines);

}  // namespace phantom::synthetic_viewer
