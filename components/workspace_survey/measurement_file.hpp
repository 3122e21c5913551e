#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/survey/measurement.hpp"

namespace phantom::workspace_survey {

/// Measurements as CSV: one line per targeting. The first line that is no comment (#) names the columns, with
/// their units:
///
///     face,part,node,range_mm,pan_deg,tilt_deg
///     top,whole,1,3512.4,12.31,61.20
///
/// `face` and `node` name things, without # in front, as in the first column that would begin a comment;
/// `part` (may be left out) is "whole" if all corners of the face are measured, in order, or "part" for some
/// that follow one another: an edge, a corner. Range is range_m or range_mm, angles are pan_deg or pan_rad,
/// tilt_deg or tilt_rad. Range and angles left empty: the node was measured in a line before, and lies on
/// this face, too.
///
/// Throws core::ConfigError that names file, line, column, value and what is allowed; MissingError if there
/// is no such file.
std::vector<survey::Targeting> read_measurements(const std::filesystem::path& file);
/// The same from text; `name` stands for the file in messages.
std::vector<survey::Targeting> read_measurements_text(const std::string& text, const std::string& name);

/// Writes what a range head measured so that read_measurements() reads the same, to 0.01 mm and 0.0001°;
/// `comment` becomes lines of comment in front.
void write_measurements(std::ostream& out, const std::vector<survey::Targeting>& targetings,
                        const std::string& comment);

}  // namespace phantom::workspace_survey
