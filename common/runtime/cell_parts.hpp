#pragma once

// Private to this library: the readers of a cell file's parts. All throw ConfigError.

#include "common/runtime/cell_arms.hpp"
#include "common/runtime/cell_objects.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

/// The mapping's `name`: 1 to 64 bytes, as on topics, that can be shown in a line.
std::string read_name(const ConfigReader& reader);
/// Lengths in metres become voxels of `voxel_size_m`.
workspace::LayerProfile read_profile(const ConfigReader& reader, double voxel_size_m);
/// `cell_profile` serves objects that have none of their own.
ObjectConfig read_object(const ConfigReader& reader, const workspace::LayerProfile& cell_profile,
                         double voxel_size_m);
/// A solid by text: f, min_m, max_m.
geometry::ImplicitPtr read_formula_solid(const ConfigReader& reader);
/// The one shape that a mapping names (sphere, box, union, implicit …), at the pose that it gives.
geometry::ImplicitPtr read_solid(const ConfigReader& reader);
ArmConfig read_arm(const ConfigReader& reader);
LinkSkinConfig read_link_skin(const ConfigReader& reader);

}  // namespace phantom::runtime
