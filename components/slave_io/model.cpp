#include "components/slave_io/model.hpp"

#include <algorithm>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_identity.hpp"
#include "common/runtime/cell/displacement.hpp"

namespace phantom::slave_io {
ArmModel load_arm(const runtime::CellConfig& cell, const std::string& arm_name) {
  const runtime::ArmConfig& config = cell.arm(arm_name);
  ArmModel model{runtime::load_arm(config), {}, Eigen::Vector3d::Zero(), {}, config.name};
  model.identity = runtime::identity_of(cell, arm_name, model.arm);
  model.skin = runtime::load_skin(config, model.arm);
  constexpr double kFingerPitch_m = 0.006;
  model.fingers = runtime::load_fingers(config, model.arm, kFingerPitch_m);
  std::copy(config.home.begin(), config.home.end(), model.home.begin());
  model.buoyancy = runtime::load_buoyancy(cell, config, model.arm);
  if (model.buoyancy.acts()) model.object_volumes_m3 = runtime::object_volumes_m3(cell);
  if (const auto tip = model.arm.find_frame(config.tip_link))
    model.tip_in_last_link_m = tip->second.translation_m;
  return model;
}

}  // namespace phantom::slave_io
