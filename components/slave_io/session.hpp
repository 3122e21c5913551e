#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/process/stop_place.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"
#include "components/slave_io/slave_io.hpp"

namespace phantom::slave_io {

/// Returns what the operator has to know of the state of the slave with `arm`; empty: nothing. `objects`:
/// that do not bear any force.
std::string sentence(const SlaveOutputs& now, const robot::SerialArm& arm,
                     std::span<const ObjectForceBound> objects = {});

/// Runs the arm on the topics until a stop is requested. Builds the world of the simulated arm, or opens the
/// buses of the drives (waiting for them, see open_buses()). Then starts the servo thread and the publishing
/// thread, and reports health twice a second. The stop in force is kept in `stop_place`. Writes slave_io.json
/// to `report_dir` if that is not empty. Returns the exit code.
int run_session(const runtime::CellConfig& cell, const ArmModel& model, const Config& config,
                const core::NetworkOptions& network, const runtime::StopPlace& stop_place,
                const std::filesystem::path& report_dir);

}  // namespace phantom::slave_io
