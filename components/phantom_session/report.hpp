#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "components/phantom_session/collector.hpp"
#include "components/phantom_session/joint_log.hpp"
#include "components/phantom_session/supervisor.hpp"

namespace phantom::phantom_session {

/// The input of a session's report, besides the files that the components left in the folder.
struct ReportInputs {
  std::filesystem::path folder;
  double seconds = 0.0;           ///< from the moment all components were ready
  std::int64_t start_utc_ns = 0;  ///< when the collector's times began
  std::string page;               ///< address of the operator's page
  std::vector<ProcessOutcome> processes;
  const Collector& collector;
};

/// Writes summary.json, series.csv, reaches.csv and index.html into the folder. Figures that a component
/// keeps exactly (round trip, workspace, views, sound) come from its <component>.json there; a figure that
/// nobody measured is null. Throws std::runtime_error if a file cannot be written.
void write_report(const ReportInputs& inputs);

/// Returns the text of summary.json, for tests.
std::string summary_json(const ReportInputs& inputs);

/// Draws the plots beside the CSV files with gnuplot. Returns false and logs a warning if gnuplot is not
/// installed. `arm`: the arm whose joints are plotted, for their names and units; none: not known.
bool draw_plots(const std::filesystem::path& folder, const Collector& collector, const JointLog& joints,
                const std::optional<robot::SerialArm>& arm);

}  // namespace phantom::phantom_session
