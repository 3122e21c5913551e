#pragma once

#include <vector>

#include "common/runtime/cell.hpp"
#include "common/voxel/activation.hpp"
#include "components/wva_server/config.hpp"

namespace phantom::wva_server {

/// An object of the cell, ready for activation and for the viewers.
struct CellBody {
  voxel::Body body;  ///< mesh in W at the model's pose (the real deviation is not the model's to know)
  geometry::TriangleMesh mesh_O;  ///< the same in the object's frame, metres
};

/// The cell's grid.
voxel::GridSpec grid_of(const runtime::CellConfig& cell);

/// The cell's profile as the voxel library wants it. Throws runtime::ConfigError; `place` says where it
/// stands.
voxel::LayerProfile profile_of(const runtime::LayerProfileConfig& config, const std::string& place);

/// Reads every object's mesh and checks all that can be checked before activation: meshes, profiles, palette,
/// sizes, and that every object or its layers lie in the workspace at least partly. Object ids are index + 1.
/// Throws runtime::ConfigError naming the cell file, the object and what is wrong.
std::vector<CellBody> load_bodies(const runtime::CellConfig& cell, const WvaServerConfig& config);

}  // namespace phantom::wva_server
