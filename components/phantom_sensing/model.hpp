#pragma once

#include "common/core/network.hpp"
#include "common/runtime/cell.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/contact_register.hpp"
#include "components/phantom_sensing/tick_time.hpp"

namespace phantom::phantom_sensing {

/// Arm and skin of the cell's arm `config.arm`. Throws ConfigError naming the cell's file and what is wrong.
/// Logs what was left out or is coarser than the rule.
PhantomModel load_model(const runtime::CellConfig& cell, const Config& config);

/// A contacts that allows what the cell's file allows the arm `config.arm`, and knows the file's objects.
/// Throws ConfigError as allowed_contact(). The model outlives it.
ContactRegister contacts_of_cell(const runtime::CellConfig& cell, const Config& config,
                                 const PhantomModel& model);

/// The contacts that the cell's file allows the arm `config.arm`. Throws ConfigError naming an object or link
/// that is not there.
percept::AllowedContact allowed_contact(const runtime::CellConfig& cell, const Config& config,
                                        const PhantomModel& model);

/// What a tick of the configuration costs on this host, measured in a few tenths of a second. Throws
/// ConfigError as allowed_contact().
TickTime predict_tick(const runtime::CellConfig& cell, const Config& config, const PhantomModel& model);

/// The cell's objects, voxelised, layered and merged in this process, as wva_server would publish them
/// (version 1). Throws ConfigError naming the object. Takes seconds.
workspace::Workspace build_workspace(const runtime::CellConfig& cell);

}  // namespace phantom::phantom_sensing
