#pragma once

#include <string>
#include <vector>

#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_bodies.hpp"

namespace phantom::wva_server {

/// Returns a sentence for each set of objects with the same steps between neighbouring layers that are below
/// an operator's Weber fraction of viscosity (`master_io jnd`); empty: none are. An object whose layers reach
/// into a medium is judged in it, as its viscosity adds to that of the layers; in several, in the most
/// viscous. `bodies`: those of the cell's objects, in their order.
std::vector<std::string> unnoticed_step_warnings(const runtime::CellConfig& cell,
                                                 const std::vector<runtime::CellBody>& bodies,
                                                 double weber_fraction);

}  // namespace phantom::wva_server
