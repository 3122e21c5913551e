#include "components/synthetic_viewer/arm_meshes.hpp"

#include "common/core/errors.hpp"
#include "common/geometry/mesh_io.hpp"

namespace phantom::synthetic_viewer {
namespace {

[[noreturn]] void fail(const core::Status& status) {
  if (status.code() == core::ErrorCode::kNotFound) throw core::MissingError(status.message());
  throw core::ConfigError(status.message());
}

}  // namespace

std::vector<LinkMeshData> load_arm_meshes(const robot::SerialArm& arm) {
  std::vector<LinkMeshData> meshes;
  for (std::size_t link = 0; link < arm.links().size(); ++link) {
    for (const robot::LinkMesh& visual : arm.links()[link].meshes) {
      geometry::MeshImportOptions options;
      options.scale = visual.scale;
      options.y_up = false;  // URDF takes a mesh's axes as they stand
      auto mesh = geometry::load_mesh(visual.file, options);
      if (!mesh) fail(mesh.status());
      meshes.push_back({link, visual.X_link_mesh, visual.colour, std::move(mesh).value()});
    }
  }
  return meshes;
}

}  // namespace phantom::synthetic_viewer
