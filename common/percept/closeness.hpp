#pragma once

#include "common/workspace/workspace.hpp"

namespace phantom::percept {

/// Greatest μ of the fluid around the objects (neighbour layers and guard, not skin or interior), Pa·s/m; 0
/// if there is none. Reads the whole workspace once: not for a tick.
double greatest_neighbour_mu(const workspace::Workspace& workspace);

/// 0 in free space, 1 from the innermost layer on. Real-time safe: yes.
double closeness(double mu, double greatest_neighbour_mu) noexcept;

}  // namespace phantom::percept
