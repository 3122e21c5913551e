#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/layers/fidelity.hpp"
#include "common/workspace/grid.hpp"

namespace phantom::wva_server {

/// The subject of a fidelity report.
struct FidelityHead {
  std::string mesh, method;  ///< the mesh's name; layer method and element
  workspace::VoxelSize voxel_size_m;
  std::vector<int> layers_vox;
  int guard_vox = 0;
};

/// Returns the sides of a voxel as in a cell file: one number for cubes, three along x, y and z for others.
nlohmann::json sides_json(const workspace::VoxelSize& size);

/// Returns the report as CSV: one row per layer and side ("all" first); lengths in voxels or, if they are no
/// cubes, in their shortest sides.
std::string fidelity_csv(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers);
/// Returns the same report as JSON.
std::string fidelity_json(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers);

}  // namespace phantom::wva_server
