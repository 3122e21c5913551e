#pragma once

#include <cstdint>

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry {

/// The mesh of a body at its pose in W.
struct PlacedMesh {
  TriangleMesh mesh_W;
  std::uint16_t id = 0;  ///< of the body: 1…65534
};

}  // namespace phantom::geometry
