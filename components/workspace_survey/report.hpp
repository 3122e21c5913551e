#pragma once

#include <string>

#include "components/workspace_survey/config.hpp"
#include "components/workspace_survey/library.hpp"

namespace phantom::workspace_survey {

/// A measurement and what came of it, for those who tell it.
struct Told {
  const Config& config;
  const Library& library;
  const survey::Measurement& measurement;
  const survey::SurveyResult& result;
  double voxel_size_m = 0.01;
};

/// What was measured, face by face: edges, angles, area, and what the error aid says.
std::string measured_text(const Told& told);
/// The candidates, ranked, and what they leave open.
std::string candidates_text(const Told& told);
/// Pose, uncertainty, residuals and guard of the fitted object; or why there is none, and what to do.
std::string fit_text(const Told& told);
/// All of it for programs.
std::string json_text(const Told& told);

/// The guard of a fitted object, in voxels.
int guard_of(const Told& told);

}  // namespace phantom::workspace_survey
