#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "common/geometry/pose.hpp"

namespace phantom::runtime {

/// Graded fluid around an object (spec 1.4, 1.5). Layer 1 touches the surface.
struct LayerProfileConfig {
  std::vector<int> thickness_vox;     ///< per layer, ≥ 1
  std::vector<double> mu_Pa_s_per_m;  ///< per layer, strictly positive, falling outwards; same length
  double mu_skin_Pa_s_per_m = 100.0;  ///< at and inside the surface, ≥ mu of layer 1
  int guard_vox = 0;  ///< protective band of order 0 around the surface, with the μ of layer 1
};

/// A body that stands in the cell.
struct ObjectConfig {
  std::string name;
  std::filesystem::path mesh;                     ///< any format that assimp reads
  double mesh_scale = 1.0;                        ///< metres per mesh unit (0.001 for millimetres)
  bool y_up = false;                              ///< mesh has +y up; default +z
  geometry::Pose X_WO;                            ///< object frame in the workspace frame
  LayerProfileConfig profile;                     ///< the cell's, unless the object has its own
  std::array<float, 3> colour{0.7F, 0.7F, 0.7F};  ///< linear RGB, 0…1
  geometry::Pose
      X_deviation;  ///< real pose = X_WO · X_deviation: what the simulated world does not tell the model
};

}  // namespace phantom::runtime
