#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "common/core/errors.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"
#include "tests/support/files.hpp"
#include "tests/support/hot_cell.hpp"

namespace phantom::slave_io {

inline const std::filesystem::path kShipped = PHANTOM_SOURCE_DIR "/components/slave_io/slave_io.yaml";

inline const std::filesystem::path kCanFile = PHANTOM_SOURCE_DIR "/deploy/can/hot_cell_slave_io.yaml";

using test::hot_cell;
inline const ArmModel& shipped_arm() {
  static const auto model = load_arm(hot_cell(), "");
  return model;
}
inline Config shipped_config() { return load_config(kShipped, shipped_arm().arm, shipped_arm().home); }

/// A shipped file with one piece of text replaced, as a new file.
inline std::filesystem::path changed(const std::string& from, const std::string& to,
                                     const std::filesystem::path& shipped = kShipped) {
  return test::changed(shipped, from, to);
}

/// What the reader says of a changed shipped file; "accepted" if nothing.
inline std::string problem_of_changed(const std::string& from, const std::string& to,
                                      const std::filesystem::path& shipped = kShipped) {
  const auto file = changed(from, to, shipped);
  try {
    load_config(file, shipped_arm().arm, shipped_arm().home);
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(file.string() + ":"));
    return error.what();
  }
  return "accepted";
}

}  // namespace phantom::slave_io
