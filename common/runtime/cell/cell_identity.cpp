#include "common/runtime/cell/cell_identity.hpp"

namespace phantom::runtime {

robot::ModelIdentity identity_of(const CellConfig& cell, const std::string& arm_name,
                                 const robot::SerialArm& arm) {
  const ArmConfig& config = cell.arm(arm_name);
  robot::ModelIdentity identity = robot::identify(arm);
  identity.arm_file = (config.urdf.empty() ? config.file : config.urdf).string();
  identity.cell_file = cell.file.string();
  std::uint32_t print = robot::add_to_fingerprint(robot::kFingerprintStart, cell.name);
  for (int i = 0; i < 3; ++i) {
    print = robot::add_to_fingerprint(print, cell.min_m[i]);
    print = robot::add_to_fingerprint(print, cell.max_m[i]);
    print = robot::add_to_fingerprint(print, cell.voxel_size_m.sides_m()[i]);
  }
  for (const ObjectConfig& object : cell.objects) {
    print = robot::add_to_fingerprint(print, object.name);
    print = robot::add_to_fingerprint(print, object.X_WO);
    if (object.is_zone()) print = robot::add_to_fingerprint(print, "protected_zone");
  }
  identity.cell = print;
  return identity;
}

}  // namespace phantom::runtime
