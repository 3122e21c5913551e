#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::survey {

/// One closed border of a plane face: its corners, counter-clockwise as seen from outside the part.
struct BorderLoop {
  std::vector<std::uint32_t> nodes;  ///< indices into PartModel::nodes_O_m
  std::vector<double> edge_m;        ///< from corner i to corner i+1
  std::vector<double> turn_rad;      ///< at corner i, left turns positive; of a hole, along its own outline
  std::uint32_t face = 0;
  bool hole = false;
};

/// A plane face: coplanar triangles that are connected.
struct PartFace {
  Eigen::Vector3d normal_O = Eigen::Vector3d::Zero();  ///< unit, outwards
  double area_m2 = 0.0;
};

/// The measurable features of a CAD part: its plane faces with their borders (A.1: "surface patches
/// represented by planar polygons", nodes, edges, included angles). Frame O is the mesh's frame.
struct PartModel {
  std::string name;
  geometry::TriangleMesh mesh_O;
  std::vector<Eigen::Vector3d> nodes_O_m;  ///< corners of borders
  std::vector<PartFace> faces;
  std::vector<BorderLoop> loops;
  /// The outermost points of the mesh: in any motion of the part, no other point moves farther.
  std::vector<Eigen::Vector3d> extremes_O_m;
  double extent_m = 0.0;  ///< diagonal of its bounding box
};

struct PartOptions {
  double join_m = 1e-5;         ///< vertices nearer than this are merged
  double plane_rad = 0.0035;    ///< normals of a face's triangles agree within this angle …
  double plane_m = 2e-5;        ///< … and their corners lie within this of its plane
  double straight_rad = 0.035;  ///< corners with a smaller turn are not corners (T-junctions, flat facets)
};

/// Finds the features of a mesh whose triangles face outwards. Triangles are merged into faces, starting from
/// each face's largest triangle, so that facets of a curved surface do not form chains. Robust to duplicate
/// vertices and degenerate triangles. Deterministic. Not real-time safe.
PartModel make_part(const std::string& name, const geometry::TriangleMesh& mesh_O,
                    const PartOptions& options = {});

/// Returns the edges of borders at which faces differ clearly, as pairs of nodes, the lower first: not those
/// between the facets of a curve.
std::set<std::pair<std::uint32_t, std::uint32_t>> sharp_edges(const PartModel& part);

/// Returns whether the rigid motion D maps the part's shape to itself, within `tolerance_m`. Then the poses X
/// and X · D occupy the same space and cannot be told apart.
bool is_symmetry(const PartModel& part, const geometry::Pose& D, double tolerance_m = 2e-4);

}  // namespace phantom::survey
