#pragma once

#include <string>
#include <vector>

#include "common/layers/fidelity.hpp"

namespace phantom::wva_server {

/// The subject of a fidelity report.
struct FidelityHead {
  std::string mesh, method;  ///< the mesh's name; layer method and element
  double voxel_size_m = 0.0;
  std::vector<int> layers_vox;
  int guard_vox = 0;
};

/// Returns the report as CSV: one row per layer and side ("all" first); lengths in voxels.
std::string fidelity_csv(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers);
/// Returns the same report as JSON.
std::string fidelity_json(const FidelityHead& head, const std::vector<layers::LayerFidelity>& layers);

}  // namespace phantom::wva_server
