#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/runtime/cell.hpp"
#include "components/master_io/config.hpp"
#include "components/master_io/session.hpp"

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
  return load_config(kShipped, hot_cell().file, shipped_arm().arm, choices);
}

inline std::filesystem::path write_file(const std::string& text) {
  static int number = 0;
  const auto file = std::filesystem::path(testing::TempDir()) /
                    ("master_io_" + std::to_string(getpid()) + "_" + std::to_string(++number) + ".yaml");
  std::ofstream(file) << text;
  return file;
}

/// The shipped file with one piece of text replaced, as a new file.
inline std::filesystem::path changed(const std::string& from, const std::string& to) {
  std::ifstream stream(kShipped);
  std::ostringstream text;
  text << stream.rdbuf();
  std::string yaml = text.str();
  const auto at = yaml.find(from);
  if (at == std::string::npos) throw std::logic_error("not in the shipped file: " + from);
  return write_file(yaml.replace(at, from.size(), to));
}

}  // namespace phantom::master_io
