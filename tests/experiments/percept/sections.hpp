#pragma once

#include "common/workspace/workspace.hpp"
#include "tests/experiments/report.hpp"

namespace phantom::experiments {

/// What is shown of a voxel.
enum class Shown {
  kLayer,  ///< number of the layer; −1: body, 0: free
  kMu      ///< μ in Pa·s/m
};

/// A plane section through a workspace as a table for Panel::map: columns "x [mm]", "y [mm]", "z [mm]" less
/// the one that the plane is normal to, and "layer" or "mu [Pa·s/m]". `normal`: 0…2; the plane goes through
/// `at_m`.
Table& section(Report& report, const std::string& name, const workspace::Workspace& workspace, int normal,
               double at_m, Shown shown);
/// The same as a panel, in the proportions of space.
Panel& section_panel(Report& report, Plot& plot, const std::string& title, const std::string& name,
                     const workspace::Workspace& workspace, int normal, double at_m, Shown shown);

}  // namespace phantom::experiments
