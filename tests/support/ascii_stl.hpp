#pragma once

#include <sstream>
#include <string>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// The mesh as a text STL.
inline std::string ascii_stl(const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  text << "solid part\n";
  for (const auto& t : mesh.triangles) {
    text << "facet normal 0 0 0\nouter loop\n";
    for (const auto v : t) text << "vertex " << mesh.vertices_m[v].transpose() << "\n";
    text << "endloop\nendfacet\n";
  }
  text << "endsolid part\n";
  return text.str();
}

}  // namespace phantom::geometry
