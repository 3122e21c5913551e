#pragma once

#include "common/core/work_budget.hpp"
#include "common/geometry/implicit/implicit.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// Sets how finely a solid given by a formula is meshed.
struct PolygoniseOptions {
  int cells = 64;       ///< initial number along the longest side of the solid's box
  int max_cells = 256;  ///< greatest number, if walls or gaps thinner than a cell require finer cells
  /// If not null, every evaluation is counted for it by the solid's steps(); when it is used up, there is no
  /// mesh.
  core::WorkBudget* budget = nullptr;
};

/// Holds the result of polygonise().
struct Polygonised {
  TriangleMesh mesh;
  int cells = 0;  ///< final number along the longest side; 0: the shape supplied its own mesh
  bool whole =
      true;  ///< false: there are walls or gaps thinner than a cell, which may be missing or closed in places
};

/// Converts a solid's surface into a mesh by dual contouring (Ju et al. 2002). The mesh is closed (every edge
/// belongs to an even number of triangles) and its triangles are counter-clockwise seen from outside. Sharp
/// edges and corners are kept: each cell has one vertex, nearest to the tangent planes at the cell's
/// crossings. Cells are halved until walls and gaps are thicker than a cell except in a few places, or until
/// `max_cells` is reached. Where two sheets pass through one cell, the mesh touches itself. A solid without
/// inside gives an empty mesh. Cost grows with the surface. Not real-time safe.
Polygonised polygonise(const ImplicitSolid& solid, const PolygoniseOptions& options = {});

}  // namespace phantom::geometry
