#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/robot/serial_arm.hpp"
#include "common/runtime/config_reader.hpp"
#include "common/simulation/reach_script.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

struct NamedReach {
  ReachLabel label;
  simulation::Reach reach;
};

/// Reads a reaches file: a list `reaches` of {name, object, from, target}. Joint counts and limits are
/// checked against `arm`. Throws ConfigError.
std::vector<NamedReach> load_reaches(const std::filesystem::path& file, const robot::SerialArm& arm);

/// The reaches that the list `only` of `sequence` names, in that order; all if it is absent or empty. Throws
/// ConfigError naming those there are.
std::vector<NamedReach> choose_reaches(const runtime::ConfigReader& sequence,
                                       const std::vector<NamedReach>& all);

}  // namespace phantom::master_io
