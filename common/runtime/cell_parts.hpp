#pragma once

// Private to this library: readers of the parts of a cell file. All throw ConfigError.

#include "common/runtime/cell_arms.hpp"
#include "common/runtime/cell_objects.hpp"
#include "common/runtime/config_reader.hpp"

namespace phantom::runtime {

/// Reads the mapping's `name`: 1 to 64 bytes, as on topics, of printable UTF-8.
std::string read_name(const ConfigReader& reader);
/// Reads a layer profile. Lengths in metres are converted to voxels of `voxel_size_m`.
workspace::LayerProfile read_profile(const ConfigReader& reader, double voxel_size_m);
/// Reads an object. `cell_profile` is the profile of objects without one of their own.
ObjectConfig read_object(const ConfigReader& reader, const workspace::LayerProfile& cell_profile,
                         double voxel_size_m);
/// Reads a solid given by a formula, with the keys f, min_m and max_m.
geometry::ImplicitPtr read_formula_solid(const ConfigReader& reader);
/// Reads the one shape of a mapping (sphere, box, union, implicit …), at the pose given there.
geometry::ImplicitPtr read_solid(const ConfigReader& reader);
ArmConfig read_arm(const ConfigReader& reader);
LinkSkinConfig read_link_skin(const ConfigReader& reader);

}  // namespace phantom::runtime
