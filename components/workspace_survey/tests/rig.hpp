#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/core/errors.hpp"
#include "common/survey/visible.hpp"
#include "components/workspace_survey/commands.hpp"
#include "components/workspace_survey/library.hpp"
#include "tests/support/files.hpp"

namespace phantom::workspace_survey {

inline std::filesystem::path source(const std::string& relative) {
  return std::filesystem::path(PHANTOM_SOURCE_DIR) / relative;
}
inline Config shipped_config() {
  return load_config(source("components/workspace_survey/workspace_survey.yaml"));
}

inline const Library& shipped_library() {
  static const Library library = load_library(source("deploy/parts"));
  return library;
}

/// Message of the ConfigError or MissingError that `act` throws.
template <class Act>
std::string refusal(const Act& act) {
  try {
    act();
  } catch (const std::runtime_error& problem) {
    return problem.what();
  }
  return "accepted";
}

/// A folder of the test's own.
class InFolder : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string read(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  const std::filesystem::path folder_ = test::new_folder();
};

}  // namespace phantom::workspace_survey
