#pragma once

// Private to this library: the readers of a cell file's parts. All throw ConfigError.

#include "common/runtime/cell_arms.hpp"
#include "common/runtime/cell_objects.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

LayerProfileConfig read_profile(const ConfigReader& reader);
/// `cell_profile` serves objects that have none of their own.
ObjectConfig read_object(const ConfigReader& reader, const LayerProfileConfig& cell_profile);
ArmConfig read_arm(const ConfigReader& reader);

}  // namespace phantom::runtime
