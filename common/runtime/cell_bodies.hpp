#pragma once

#include <string>
#include <vector>

#include "common/geometry/mesh_io.hpp"
#include "common/layers/activation.hpp"
#include "common/runtime/cell.hpp"
#include "common/voxelise/distance_field.hpp"

namespace phantom::runtime {

/// An object of the cell, ready for activation and for the viewers.
struct CellBody {
  layers::Body body;  ///< in W at the model's pose (the real deviation is not the model's to know)
  geometry::TriangleMesh
      mesh_O;  ///< its surface in the object's frame, metres; of a solid by formula, made from it
  std::vector<std::string> notes;  ///< what had to be assumed, each a sentence to warn with
};

/// The cell's grid.
workspace::GridSpec grid_of(const CellConfig& cell);

/// Reads an object's mesh, or makes one of its formula, and checks all that can be checked before activation:
/// the mesh, and that the object or its layers lie in the workspace at least partly. Of `limits` the scale
/// and the up-axis are not used: they are the object's own. Throws ConfigError naming the object's place and
/// what is wrong. Thread-safe, not real-time safe.
CellBody load_body(const ObjectConfig& object, const CellConfig& cell,
                   const geometry::MeshImportOptions& limits = {});

/// The body of an object whose surface is loaded already, at the pose that `object` has now; checked as
/// load_body() does.
layers::Body place_body(const ObjectConfig& object, const geometry::TriangleMesh& mesh_O,
                        const CellConfig& cell);

/// All objects of the cell, in its order. Checks also that their profiles fit one palette.
std::vector<CellBody> load_bodies(const CellConfig& cell, const geometry::MeshImportOptions& limits = {});

/// The surfaces of the cell's objects where they really stand: model pose · real deviation. Wherever they
/// stand; for the simulated world.
std::vector<voxelise::FieldBody> load_real_bodies(const CellConfig& cell,
                                                  const geometry::MeshImportOptions& limits = {});

}  // namespace phantom::runtime
