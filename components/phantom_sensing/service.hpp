#pragma once

#include "common/runtime/cell.hpp"
#include "common/runtime/deployment.hpp"
#include "components/phantom_sensing/config.hpp"

namespace phantom::phantom_sensing {

/// Runs the component until a stop is requested: readers → workspace keeper and sensing loop → writers,
/// status at 2 Hz. With `report_dir` leaves phantom_sensing.json there. Throws DdsError. Returns the exit
/// code.
int run_service(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const runtime::CellConfig& cell, const Config& config, const PhantomModel& model);

}  // namespace phantom::phantom_sensing
