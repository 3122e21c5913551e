#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/serial_arm.hpp"
#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/joint_log.hpp"
#include "components/phantom_session/supervisor.hpp"

namespace phantom::phantom_session {

/// What a session's report is made of, besides the files that the components left in the folder.
struct ReportInputs {
  std::filesystem::path folder;
  double seconds = 0.0;           ///< from the moment all components were ready
  std::int64_t start_utc_ns = 0;  ///< when the collector's times began
  std::string page;               ///< address of the operator's page
  std::vector<ProcessOutcome> processes;
  const Collector& collector;
};

/// Writes summary.json (design of the demo report), series.csv, reaches.csv and index.html into the folder.
/// Figures that a component keeps exactly (round trip, workspace, views, sound) come from its own
/// <component>.json there; a figure that nobody measured is null. Throws std::runtime_error if a file cannot
/// be written.
void write_report(const ReportInputs& inputs);

/// summary.json as text, for tests.
std::string summary_json(const ReportInputs& inputs);

/// Draws the plots beside the CSV files with gnuplot; returns false (and says so) if gnuplot is not
/// installed. `arm`: whose joints they are, for their names and units; none: not known.
bool draw_plots(const std::filesystem::path& folder, const Collector& collector, const JointLog& joints,
                const std::optional<robot::SerialArm>& arm);

}  // namespace phantom::phantom_session
