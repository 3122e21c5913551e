#pragma once

#include "components/slave_io/simulated_world.hpp"
#include "tests/experiments/experiment.hpp"

namespace phantom::experiments {

/// The simulated arm of a shipped cell, and what gives way round it.
class SimulatedCell {
 public:
  /// `cell`: its folder in deploy/cells.
  SimulatedCell(const Settings& settings, const std::string& cell)
      : SimulatedCell(settings,
                      runtime::load_cell(settings.source_dir / "deploy/cells" / cell / "cell.yaml")) {}

  /// The forces from outside on the joints at a pose and at velocities, in N or N·m.
  core::JointArray force(const core::JointArray& q, const core::JointArray& v) {
    robot::LinkPoses X_WL;
    model_.arm.link_poses(q, X_WL);
    world_.yielding->sense(model_.arm, X_WL, q, v, 0.0);
    return world_.yielding->joints().torque(q, v);
  }

 private:
  SimulatedCell(const Settings& settings, const runtime::CellConfig& cell)
      : model_(slave_io::load_arm(cell, "")),
        world_(slave_io::load_world(
            cell, model_,
            slave_io::load_config(settings.source_dir / "components/slave_io/slave_io.yaml", model_.arm,
                                  model_.home)
                .contact)) {}

  slave_io::ArmModel model_;
  slave_io::SimulatedWorld world_;
};

}  // namespace phantom::experiments
