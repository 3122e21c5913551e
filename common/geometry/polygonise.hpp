#pragma once

#include "common/geometry/implicit.hpp"
#include "common/geometry/mesh.hpp"

namespace phantom::geometry {

/// How finely a solid by formula becomes a mesh.
struct PolygoniseOptions {
  int cells = 64;       ///< along the longest side of the solid's box, at first
  int max_cells = 256;  ///< at most, when walls or gaps thinner than a cell make finer cells necessary
};

/// What polygonise() made.
struct Polygonised {
  TriangleMesh mesh;
  int cells = 0;  ///< along the longest side, in the end; 0: the shape made its own mesh
  bool whole =
      true;  ///< false: walls or gaps thinner than a cell are there, and may be missing or closed in places
};

/// The solid's surface as a mesh: closed (every edge belongs to an even number of triangles), triangles
/// counter-clockwise seen from outside, sharp edges and corners kept: one vertex per cell, nearest to the
/// tangent planes at the cell's crossings (dual contouring; Ju et al. 2002). Cells are halved until walls and
/// gaps are thicker than a cell, but for a few places, or `max_cells` is reached. Where two sheets pass
/// through one cell the mesh touches itself. A solid without inside gives an empty mesh. Cost rises with the
/// surface. Not real-time safe.
Polygonised polygonise(const ImplicitSolid& solid, const PolygoniseOptions& options = {});

}  // namespace phantom::geometry
