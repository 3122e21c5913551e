#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/fields.hpp"
#include "common/simulation/reach_script.hpp"
#include "components/master_io/config.hpp"

namespace phantom::master_io {

struct NamedReach {
  ReachLabel label;
  simulation::Reach reach;
};

extern const char* const kReachKeys;  ///< table of the keys of a reaches file (reaches.yaml)

/// Reads a reaches file. Checks joint counts and limits against `arm`. Throws ConfigError.
std::vector<NamedReach> load_reaches(const std::filesystem::path& file, const robot::SerialArm& arm);

/// Returns the reaches named by the list `only` of `sequence`, in that order; all if the list is absent or
/// empty. Throws ConfigError with the known names.
std::vector<NamedReach> choose_reaches(const runtime::Fields& sequence, const std::vector<NamedReach>& all);

}  // namespace phantom::master_io
