#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::survey {

/// One closed border of a plane face: its corners, counter-clockwise seen from outside of the part.
struct BorderLoop {
  std::vector<std::uint32_t> nodes;  ///< indices into PartModel::nodes_O_m
  std::vector<double> edge_m;        ///< from corner i to corner i+1
  std::vector<double> turn_rad;  ///< at corner i, left turns positive; a hole's are those of its own outline
  std::uint32_t face = 0;
  bool hole = false;
};

/// A plane face: coplanar triangles that hang together.
struct PartFace {
  Eigen::Vector3d normal_O = Eigen::Vector3d::Zero();  ///< unit, outwards
  double area_m2 = 0.0;
};

/// What can be measured of a CAD part: its plane faces with their borders (A.1: "surface patches represented
/// by planar polygons", nodes, edges, included angles). Frame O is the mesh's.
struct PartModel {
  std::string name;
  geometry::TriangleMesh mesh_O;
  std::vector<Eigen::Vector3d> nodes_O_m;  ///< corners of borders
  std::vector<PartFace> faces;
  std::vector<BorderLoop> loops;
  std::vector<Eigen::Vector3d>
      extremes_O_m;       ///< points of the mesh that lie outermost: no other moves farther with it
  double extent_m = 0.0;  ///< diagonal of its box
};

struct PartOptions {
  double join_m = 1e-5;         ///< vertices nearer than this are one
  double plane_rad = 0.0035;    ///< normals of a face's triangles agree within this …
  double plane_m = 2e-5;        ///< … and their corners lie within this of its plane
  double straight_rad = 0.035;  ///< corners that turn less are none (T-junctions, flat facets)
};

/// Features of a mesh whose triangles face outwards: triangles are merged to faces, face by face from its
/// largest triangle outwards, so that facets of a curved surface do not chain up. Robust to duplicate
/// vertices and degenerate triangles. Deterministic. Not real-time safe.
PartModel make_part(const std::string& name, const geometry::TriangleMesh& mesh_O,
                    const PartOptions& options = {});

/// Whether a rigid motion of the part takes its shape into itself, within `tolerance_m`: then the poses X and
/// X · D occupy the same space, and nobody can tell them apart.
bool is_symmetry(const PartModel& part, const geometry::Pose& D, double tolerance_m = 2e-4);

}  // namespace phantom::survey
