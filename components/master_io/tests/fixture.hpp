#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "common/runtime/cell.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/session.hpp"
#include "tests/support/files.hpp"

namespace phantom::master_io {

inline const std::filesystem::path kShipped = PHANTOM_SOURCE_DIR "/components/master_io/master_io.yaml";

inline const runtime::CellConfig& hot_cell() {
  static const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  return cell;
}
inline const ArmModel& shipped_arm() {
  static const auto model = load_arm(hot_cell(), "");
  return model;
}
inline Config shipped_config(const Choices& choices = {}) {
  return load_config(kShipped, hot_cell().file, shipped_arm().arm, shipped_arm().home, choices);
}

/// A file, if no other is named the shipped one, with one piece of text replaced.
inline std::filesystem::path changed(const std::string& from, const std::string& to,
                                     const std::filesystem::path& file = kShipped) {
  return test::changed(file, from, to);
}

}  // namespace phantom::master_io
