#pragma once

#include <filesystem>

#include "common/survey/survey.hpp"
#include "common/survey/touch.hpp"

namespace phantom::workspace_survey {

/// The values of workspace_survey.yaml.
struct Config {
  survey::RangeHead head;
  survey::HeadErrors errors;
  survey::SurveyOptions options;
  survey::TouchOptions touch;
  double touch_sigma_m = 0.0005;  ///< of what a contact says about the touched surface's place
};

extern const char* const kParameters;  ///< the parameter table: the shipped workspace_survey.yaml

/// Reads and checks a configuration. Throws core::ConfigError (file, line, key, value, what is allowed).
Config load_config(const std::filesystem::path& path);

}  // namespace phantom::workspace_survey
