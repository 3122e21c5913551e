#pragma once

#include <string>
#include <vector>

#include "common/core/work_budget.hpp"
#include "common/geometry/mesh/mesh_io.hpp"
#include "common/geometry/mesh/placed_mesh.hpp"
#include "common/layers/activation.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::runtime {

/// An object of the cell with its surface loaded, ready for activation and for the viewers.
struct CellBody {
  layers::Body body;               ///< in W at the model's pose; the model does not know the real deviation
  geometry::TriangleMesh mesh_O;   ///< the surface in the object's frame, metres; triangulated if the object
                                   ///< is a solid by formula
  std::vector<std::string> notes;  ///< assumptions made while loading, each a sentence of a warning
};

/// Returns the voxel grid over the cell's workspace.
workspace::GridSpec grid_of(const CellConfig& cell);

/// Loads an object's surface from its mesh or formula, and checks all that can be checked before activation:
/// the mesh, and that the object or its layers lie at least partly in the workspace. The scale and the
/// up-axis in `limits` are not used; the object has its own. Throws ConfigError naming the object's place and
/// the problem. Thread-safe, not real-time safe.
/// `budget`: if not null, what a formula's surface takes is counted for it.
CellBody load_body(const ObjectConfig& object, const CellConfig& cell,
                   const geometry::MeshImportOptions& limits = {}, core::WorkBudget* budget = nullptr);

/// Returns the body of an object whose surface is loaded already, at the present pose of `object`. Checks it
/// as load_body() does.
layers::Body place_body(const ObjectConfig& object, const geometry::TriangleMesh& mesh_O,
                        const CellConfig& cell);

/// Loads all objects of the cell in its order. Checks also that their profiles fit into one palette.
std::vector<CellBody> load_bodies(const CellConfig& cell, const geometry::MeshImportOptions& limits = {});

/// Loads the surfaces of the cell's objects at their real poses: model pose · real deviation. The poses may
/// lie outside of the workspace. Loose objects, those that an arm carries from the start, and protected
/// zones, which are no bodies, are left out. For the simulated world.
std::vector<geometry::PlacedMesh> load_real_bodies(const CellConfig& cell,
                                                   const geometry::MeshImportOptions& limits = {});

/// A loose object of the cell in the simulated world.
struct LooseMesh {
  std::uint16_t id = 0;
  geometry::TriangleMesh mesh_O;
  geometry::Pose X_WO;  ///< real, at the start
  double mass_kg = 0.0;
};

/// Loads the cell's loose objects. Throws as load_real_bodies().
std::vector<LooseMesh> load_loose_bodies(const CellConfig& cell,
                                         const geometry::MeshImportOptions& limits = {});

}  // namespace phantom::runtime
