#pragma once

#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "components/phantom_sensing/config.hpp"
#include "components/phantom_sensing/other_arms.hpp"

namespace phantom::phantom_sensing {

/// Runs the component until a stop is requested: readers → workspace keeper and sensing loop → writers, with
/// status at 2 Hz. Writes phantom_sensing.json if a `report_dir` is given. Returns the exit code. Throws
/// DdsError.
int run_service(const runtime::ProcessOptions& options, const runtime::Deployment& deployment,
                const runtime::CellConfig& cell, const Config& config, const PhantomModel& model,
                const std::vector<OtherArm>& others);

}  // namespace phantom::phantom_sensing
