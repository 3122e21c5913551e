#include "common/robot/skin/finger_points.hpp"

#include "common/robot/kinematics/link_mesh.hpp"
#include "common/robot/skin/carried_skin.hpp"

namespace phantom::robot {

core::Expected<std::vector<FingerPoint>> finger_points(const SerialArm& open, const SerialArm& closed,
                                                       double pitch_m) {
  std::vector<FingerPoint> points;
  for (std::size_t link = 0; link < open.links().size(); ++link) {
    for (std::size_t i = 0; i < open.links()[link].meshes.size(); ++i) {
      const LinkMesh& part = open.links()[link].meshes[i];
      const Eigen::Vector3d closing_m =
          closed.links()[link].meshes[i].X_link_mesh.translation_m - part.X_link_mesh.translation_m;
      if (closing_m.norm() < 1e-6) continue;
      const auto mesh = load_mesh(part);
      if (!mesh) return mesh.status();
      const auto skin = lay_out_body(*mesh, {.voxel_size_m = pitch_m, .pitch_vox = 1.0});
      if (!skin) return core::Status::invalid_argument("gripper: " + skin.status().message());
      for (const Eigen::Vector3d& p_m : skin->positions_m)
        points.push_back({link, part.X_link_mesh * p_m, closing_m});
    }
  }
  return points;
}

}  // namespace phantom::robot
