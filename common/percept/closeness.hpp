#pragma once

#include "common/workspace/workspace.hpp"

namespace phantom::percept {

/// Returns the greatest μ of the fluid around the objects in Pa·s/m (neighbour layers and guard, not skin or
/// interior), or 0 if there is no fluid. Reads the whole workspace, so not for use in a tick.
double greatest_neighbour_mu(const workspace::Workspace& workspace);

/// Returns the closeness: 0 in free space, 1 from the innermost layer on. Real-time safe: yes.
double closeness(double mu, double greatest_neighbour_mu) noexcept;

}  // namespace phantom::percept
