#include "components/workspace_camera/loaded_cell.hpp"

#include <algorithm>

#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/cell/cell_names.hpp"

namespace phantom::workspace_camera {
namespace {

std::unique_ptr<ArmView> load_arm_view(const runtime::CellConfig& cell, const std::string& name) {
  if (cell.arms.empty() && name.empty()) return nullptr;
  const runtime::ArmConfig& config = cell.arm(name);
  robot::SerialArm arm = runtime::load_arm(config);
  robot::SkinOptions options;
  options.voxel_size_m = cell.voxel_size_m;
  auto skin = robot::lay_out_skin(arm, runtime::load_skin(config, arm), options);
  if (!skin) throw core::ConfigError("arm '" + config.name + "': " + skin.status().message());
  const double pitch_m = options.pitch_vox * cell.voxel_size_m.reference_m();
  return std::make_unique<ArmView>(std::move(arm), runtime::load_closed_arm(config), std::move(skin).value(),
                                   pitch_m);
}

/// Returns a room around the workspace and the cameras: a camera measures nothing where it sees nothing, and
/// only what lies before something measured is seen to be free.
geometry::TriangleMesh room_around(const runtime::CellConfig& cell, const WorkspaceCameraConfig& config) {
  constexpr double kToFloor_m = 0.03, kToWall_m = 0.3;  // outside of the workspace: of no voxel
  Eigen::Vector3d low = cell.min_m, high = cell.max_m;
  for (const CameraConfig& camera : config.cameras) {
    low = low.cwiseMin(camera.X_FC.translation_m);
    high = high.cwiseMax(camera.X_FC.translation_m);
  }
  low -= Eigen::Vector3d(kToWall_m, kToWall_m, kToFloor_m);
  high += Eigen::Vector3d::Constant(kToWall_m);
  return geometry::make_box(high - low).transformed({Eigen::Matrix3d::Identity(), 0.5 * (low + high)});
}

/// Takes the displaced objects out of the real cell.
std::vector<DisplacedMesh> take_displaced(runtime::CellConfig& cell, const WorkspaceCameraConfig& config) {
  std::vector<DisplacedMesh> displaced;
  for (const Displacement& one : config.displaced) {
    const auto object = std::ranges::find(cell.objects, one.object, &runtime::ObjectConfig::name);
    if (object == cell.objects.end())
      throw core::ConfigError(one.place + ".object: the cell has no object '" + one.object +
                              "', or it is named twice; allowed, each once: " +
                              core::listed(cell.objects, &runtime::ObjectConfig::name));
    runtime::CellConfig alone = cell;
    alone.objects = {*object};
    for (geometry::PlacedMesh& body : runtime::load_real_bodies(alone))
      displaced.push_back({std::move(body.mesh_W), one.by_m, one.from_s});
    cell.objects.erase(object);
  }
  return displaced;
}

std::unique_ptr<const fusion::CameraScene> load_scene(const runtime::CellConfig& cell,
                                                      const WorkspaceCameraConfig& config) {
  std::vector<fusion::CameraScene::Object> objects{{room_around(cell, config), false}};
  for (const geometry::PlacedMesh& body : runtime::load_real_bodies(cell))
    objects.push_back({body.mesh_W, false});
  return std::make_unique<const fusion::CameraScene>(objects);
}

}  // namespace

LoadedCell load_cell(const WorkspaceCameraConfig& config, const std::filesystem::path& cell_file) {
  LoadedCell loaded;
  loaded.cell = runtime::load_checked_cell(cell_file, runtime::CellArms::kOptional);
  loaded.arm = load_arm_view(loaded.cell, config.arm);
  if (config.has(CameraDriver::kSimulated)) {
    runtime::CellConfig real = loaded.cell;
    loaded.displaced = take_displaced(real, config);
    loaded.simulated = load_scene(real, config);
  }
  for (runtime::CellBody& body : runtime::load_bodies(loaded.cell)) {
    const std::uint64_t hash = body.mesh_O.content_hash();
    loaded.meshes.emplace_back(hash, std::move(body.mesh_O));
  }
  for (const CameraConfig& camera : config.cameras) {
    if (camera.driver == CameraDriver::kSimulated && !camera.link.empty())
      throw core::ConfigError(camera.place +
                              ".link: is of a simulated camera; allowed: driver: sim with link: \"\"");
  }
  return loaded;
}

}  // namespace phantom::workspace_camera
