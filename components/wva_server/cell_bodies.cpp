#include "components/wva_server/cell_bodies.hpp"

#include <spdlog/spdlog.h>

#include <sstream>

#include "common/runtime/config_reader.hpp"

namespace phantom::wva_server {
namespace {

std::string span_text(const geometry::BoundingBox& box) {
  std::ostringstream text;
  text.precision(3);
  const char* names = "xyz";
  for (int axis = 0; axis < 3; ++axis) {
    text << (axis == 0 ? "" : ", ") << names[axis] << ' ' << box.min_m[axis] << " to " << box.max_m[axis];
  }
  return text.str() + " m";
}

void check_place(const voxel::Body& body, const runtime::CellConfig& cell, const std::string& place) {
  const auto reach_m = static_cast<float>(body.profile.reach_vox() * cell.voxel_size_m);
  geometry::BoundingBox workspace;
  workspace.extend(cell.min_m.cast<float>() - Eigen::Vector3f::Constant(reach_m));
  workspace.extend(cell.max_m.cast<float>() + Eigen::Vector3f::Constant(reach_m));
  const geometry::BoundingBox box = body.mesh_W.bounding_box();
  if (box.intersects(workspace)) return;
  throw runtime::ConfigError(place + "lies outside of the workspace with all its layers: it spans " +
                             span_text(box) + "; is its pose or its mesh_scale right?");
}

}  // namespace

voxel::GridSpec grid_of(const runtime::CellConfig& cell) {
  return voxel::grid_over(cell.min_m, cell.max_m, cell.voxel_size_m);
}

voxel::LayerProfile profile_of(const runtime::LayerProfileConfig& config, const std::string& place) {
  voxel::LayerProfile profile;
  profile.thickness_vox = config.thickness_vox;
  profile.mu_Pa_s_per_m.assign(config.mu_Pa_s_per_m.begin(), config.mu_Pa_s_per_m.end());
  profile.mu_skin_Pa_s_per_m = static_cast<float>(config.mu_skin_Pa_s_per_m);
  profile.guard_vox = config.guard_vox;
  if (const auto checked = voxel::check_profile(profile); !checked) {
    throw runtime::ConfigError(place + checked.message());
  }
  return profile;
}

std::vector<CellBody> load_bodies(const runtime::CellConfig& cell, const WvaServerConfig& config) {
  std::vector<CellBody> bodies;
  std::vector<voxel::LayerProfile> profiles;
  for (std::size_t i = 0; i < cell.objects.size(); ++i) {
    const runtime::ObjectConfig& object = cell.objects[i];
    const std::string place =
        cell.file.string() + ": objects[" + std::to_string(i) + "] '" + object.name + "': ";
    geometry::MeshImportOptions options = config.mesh_import;
    options.scale = object.mesh_scale;
    options.y_up = object.y_up;
    auto mesh = geometry::load_mesh(object.mesh, options);
    if (!mesh) throw runtime::ConfigError(place + mesh.status().message());
    spdlog::debug("object {}: {} triangles from {}", object.name, mesh->triangles.size(),
                  object.mesh.string());
    CellBody body{{object.name, static_cast<std::uint16_t>(i + 1), mesh->transformed(object.X_WO),
                   profile_of(object.profile, place)},
                  std::move(*mesh)};
    check_place(body.body, cell, place);
    profiles.push_back(body.body.profile);
    bodies.push_back(std::move(body));
  }
  if (const auto palette = voxel::make_palette(profiles); !palette) {
    throw runtime::ConfigError(cell.file.string() + ": objects: " + palette.status().message());
  }
  return bodies;
}

}  // namespace phantom::wva_server
