#pragma once

#include <memory>
#include <vector>

#include "common/runtime/cell/cell.hpp"
#include "common/simulation/loose_objects.hpp"
#include "common/simulation/mesh_world.hpp"
#include "common/simulation/yielding.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

/// What the simulated arm meets in a cell, where it really stands.
struct SimulatedWorld {
  std::unique_ptr<const simulation::MeshWorld> fixed;
  std::vector<simulation::LooseObject> loose;
  std::unique_ptr<simulation::Yielding> yielding;  ///< null: the cell has neither media nor soft bodies
};

/// Loads the cell's objects and media. The arm feels what gives way with points of its skin two voxels apart,
/// or as far as it takes for `config.max_points` of them. Throws ConfigError.
SimulatedWorld load_world(const runtime::CellConfig& cell, const ArmModel& model,
                          const ContactConfig& config);

}  // namespace phantom::slave_io
