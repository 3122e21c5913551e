#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/survey/measurement.hpp"

namespace phantom::workspace_survey {

/// Reads measurements from CSV: one line per targeting. The first line that is not a comment (#) names the
/// columns, with their units:
///
///     face,part,node,range_mm,pan_deg,tilt_deg
///     top,whole,1,3512.4,12.31,61.20
///
/// `face` and `node` are names; in the first column a name must not begin with #, which would begin a
/// comment. `part` (optional) is "whole" if all corners of the face are measured, in order, or "part" for
/// some successive corners: an edge, a corner. Range is range_m or range_mm, angles are pan_deg or pan_rad,
/// tilt_deg or tilt_rad. If range and angles are empty, the node was measured in an earlier line, and lies on
/// this face, too.
///
/// Throws core::ConfigError that names file, line, column, value and what is allowed; MissingError if the
/// file does not exist.
std::vector<survey::Targeting> read_measurements(const std::filesystem::path& file);
/// Reads measurements from text; `name` replaces the file in messages.
std::vector<survey::Targeting> read_measurements_text(const std::string& text, const std::string& name);

/// Writes the readings of a range head so that read_measurements() reads them back to 0.01 mm and 0.0001°.
/// `comment` becomes comment lines at the start.
void write_measurements(std::ostream& out, const std::vector<survey::Targeting>& targetings,
                        const std::string& comment);

}  // namespace phantom::workspace_survey
