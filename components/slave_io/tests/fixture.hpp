#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/runtime/cell.hpp"
#include "components/slave_io/config.hpp"
#include "components/slave_io/model.hpp"

namespace phantom::slave_io {

inline const std::filesystem::path kShipped = PHANTOM_SOURCE_DIR "/components/slave_io/slave_io.yaml";

inline const std::filesystem::path kCanFile = PHANTOM_SOURCE_DIR "/deploy/can/hot_cell_slave_io.yaml";

inline const runtime::CellConfig& hot_cell() {
  static const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  return cell;
}
inline const ArmModel& shipped_arm() {
  static const auto model = load_arm(hot_cell(), "");
  return model;
}
inline Config shipped_config() { return load_config(kShipped, shipped_arm().arm, shipped_arm().home); }

/// A shipped file with one piece of text replaced, as a new file.
inline std::filesystem::path changed(const std::string& from, const std::string& to,
                                     const std::filesystem::path& shipped = kShipped) {
  std::ifstream stream(shipped);
  std::ostringstream text;
  text << stream.rdbuf();
  std::string yaml = text.str();
  const auto at = yaml.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the shipped file: " + from);
  yaml.replace(at, from.size(), to);
  static int number = 0;
  const auto file = std::filesystem::path(testing::TempDir()) /
                    ("slave_io_" + std::to_string(getpid()) + "_" + std::to_string(++number) + ".yaml");
  std::ofstream(file) << yaml;
  return file;
}

}  // namespace phantom::slave_io
