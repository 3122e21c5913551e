#pragma once

#include <cstdint>
#include <vector>

#include "components/workspace_survey/report.hpp"

namespace phantom::workspace_survey {

/// Returns a PNG picture. It shows the fitted part as the head sees it, with the measured nodes and their
/// distances from the model (magnified), and beside it each node's residual along and across the beam. Needs
/// a fitted object.
std::vector<std::uint8_t> residual_picture(const SurveyReport& report);

}  // namespace phantom::workspace_survey
