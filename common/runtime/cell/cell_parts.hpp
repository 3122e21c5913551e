#pragma once

// Private to this library: readers of the parts of a cell file. All throw ConfigError. Each reads the kind of
// section that its name says (cell.yaml, arm.yaml).

#include "common/runtime/cell/cell.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::runtime {

/// Returns the table of the keys of cell and arm files.
const FieldTable& cell_table();
/// Reads the mapping's `name`, as on topics, of printable UTF-8.
std::string read_name(const Fields& fields);
/// Reads a profile for voxels of this size. Logs where its layers differ from the text's or may be missing.
workspace::LayerProfile read_profile(const Fields& fields, const workspace::VoxelSize& size);
/// Refuses a profile that is no good in voxels of this size.
void check_in_voxels(const Fields& fields, const workspace::LayerProfile& profile,
                     const workspace::VoxelSize& size);
/// `cell_profile` is the profile of objects without one of their own.
ObjectConfig read_object(const Fields& fields, const workspace::LayerProfile& cell_profile,
                         const workspace::VoxelSize& size);
/// Reads a solid given by a formula, with the keys f, min_m and max_m.
geometry::ImplicitPtr read_formula_solid(const Fields& fields);
/// Reads the one shape of a mapping (sphere, box, union, implicit …), at the pose given there.
geometry::ImplicitPtr read_shape(const Fields& fields);
ArmConfig read_mounted_arm(const Fields& fields);
LinkSkinConfig read_link_skin(const Fields& fields);

}  // namespace phantom::runtime
