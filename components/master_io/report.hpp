#pragma once

#include <filesystem>
#include <vector>

#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/reaches/reach_log.hpp"

namespace phantom::master_io {

struct SessionFigures {
  std::vector<core::LoopStatistics> loops;
  core::DurationHistogram round_trips;
  const CartesianFigures* cartesian = nullptr;  ///< of a Cartesian device
  const MappingFigures* mapping = nullptr;      ///< of a master with fewer joints than the arm
};

/// Writes master_io.json: loops, round trips, reaches, and the damping that the device's stability allows for
/// each joint.
void write_report(const std::filesystem::path& file, const SessionFigures& figures, const ReachLog& reaches,
                  const Config& config, const runtime::CellConfig& cell);

}  // namespace phantom::master_io
