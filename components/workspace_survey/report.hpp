#pragma once

#include <string>

#include "common/workspace/grid.hpp"
#include "components/workspace_survey/config.hpp"
#include "components/workspace_survey/library.hpp"

namespace phantom::workspace_survey {

/// A measurement and its result, for the reports.
struct SurveyReport {
  const Config& config;
  const Library& library;
  const survey::Measurement& measurement;
  const survey::SurveyResult& result;
  workspace::VoxelSize voxel_size_m = 0.01;
};

/// Returns the measurement, face by face: edges, angles, area, and what the error aid reports.
std::string measured_text(const SurveyReport& report);
/// Returns the candidates, ranked, and what they leave undecided.
std::string candidates_text(const SurveyReport& report);
/// Returns pose, uncertainty, residuals and guard of the fitted object; or why there is none, and what to do.
std::string fit_text(const SurveyReport& report);
/// Returns all of it as JSON, for programs.
std::string json_text(const SurveyReport& report);

/// Returns which of several alternatives a person may choose by their numbers, or what is left to do; "" if
/// nothing is open.
std::string alternatives_text(const SurveyReport& report);

/// Returns the guard of a fitted object, in voxels.
int guard_of(const SurveyReport& report);
/// Returns what such a voxel measures, as words: "5 mm"; if it is no cube, the shortest side and all three.
std::string guard_voxel_text(const workspace::VoxelSize& size);

}  // namespace phantom::workspace_survey
