#pragma once

#include "common/runtime/cell/cell.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/tools/tick_time.hpp"

namespace phantom::phantom_sensing {

/// Returns the cell in whose voxels this process senses: `cell`, the deployment's, or the own share's. Throws
/// ConfigError if a share's cell has other objects or another arm.
runtime::CellConfig sensed_cell(runtime::CellConfig cell, const Config& config);

/// Loads arm, skin and interest points of the cell's arm `config.arm`. Logs what was left out and where the
/// skin is coarser than the rule. Throws ConfigError naming the cell file and what is wrong.
PhantomModel load_model(const runtime::CellConfig& cell, const Config& config);

/// Returns a register that allows the contacts which the cell file allows for the arm `config.arm`, and that
/// knows the file's objects. The model must outlive it. Throws ConfigError like allowed_contact().
ContactRegister contacts_of_cell(const runtime::CellConfig& cell, const Config& config,
                                 const PhantomModel& model);

/// Returns the contacts that the cell file allows for the arm `config.arm`. Throws ConfigError naming an
/// object or link that does not exist.
percept::AllowedContact allowed_contact(const runtime::CellConfig& cell, const Config& config,
                                        const PhantomModel& model);

/// Measures what a tick costs with this configuration on this host, in a few tenths of a second. Throws
/// ConfigError like allowed_contact().
TickTime predict_tick(const runtime::CellConfig& cell, const Config& config, const PhantomModel& model);

/// Builds the workspace in this process as wva_server would publish it (version 1): the cell's objects,
/// voxelised, layered and merged. Throws ConfigError naming the object. Takes seconds.
workspace::Workspace build_workspace(const runtime::CellConfig& cell);

}  // namespace phantom::phantom_sensing
