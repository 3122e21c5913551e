#include "components/phantom_sensing/model.hpp"

#include <spdlog/spdlog.h>

#include "common/core/errors.hpp"
#include "common/geometry/mesh_io.hpp"
#include "common/voxel/activation.hpp"
#include "common/voxel/merge.hpp"

namespace phantom::phantom_sensing {
namespace {

using core::ConfigError;

std::vector<robot::LinkSkin> skin_of(const runtime::ArmConfig& arm) {
  std::vector<robot::LinkSkin> skin;
  for (const auto& link : arm.skin) {
    skin.push_back({link.link, {}});
    for (const auto& s : link.segments) {
      skin.back().segments.push_back(
          {s.from_m, s.to_m, s.from_radius_m, s.to_radius_m, s.sides, s.rings, s.spin_rad, s.gain});
    }
  }
  return skin;
}

voxel::LayerProfile profile_of(const runtime::LayerProfileConfig& config) {
  voxel::LayerProfile profile;
  profile.thickness_vox = config.thickness_vox;
  for (const double mu : config.mu_Pa_s_per_m) profile.mu_Pa_s_per_m.push_back(static_cast<float>(mu));
  profile.mu_skin_Pa_s_per_m = static_cast<float>(config.mu_skin_Pa_s_per_m);
  profile.guard_vox = config.guard_vox;
  return profile;
}

/// The value, or a ConfigError with the place in front.
template <class T>
T value_or_throw(core::Expected<T> expected, const std::string& place) {
  if (!expected) throw ConfigError(place + expected.status().message());
  return std::move(expected).value();
}

}  // namespace

PhantomModel load_model(const runtime::CellConfig& cell, const Config& config) {
  const runtime::ArmConfig& arm_config = cell.arm(config.arm);
  const std::string place = cell.file.string() + ": arm '" + arm_config.name + "': ";
  auto arm = robot::SerialArm::from_urdf(arm_config.urdf, arm_config.tip_link, arm_config.X_WB);
  if (!arm) throw ConfigError(place + arm.status().message());
  if (arm_config.home.size() != arm->joint_count()) {
    throw ConfigError(place + "home: has " + std::to_string(arm_config.home.size()) +
                      " values; allowed: " + std::to_string(arm->joint_count()) +
                      ", one for each moving joint of " + arm_config.urdf.string());
  }
  robot::SkinOptions options = config.skin;
  options.voxel_size_m = cell.voxel_size_m;
  auto skin = value_or_throw(robot::lay_out_skin(*arm, skin_of(arm_config), options), place);
  if (skin.left_out > 0) {
    spdlog::warn("{} skin segments are on the arm's base, which does not move: left out", skin.left_out);
  }
  if (options.pitch_vox > 1.0) {
    spdlog::warn("skin.pitch_vox is {}: the skin is coarser than the voxels, drag will be less smooth",
                 options.pitch_vox);
  }
  return {*std::move(arm), std::move(skin)};
}

voxel::Workspace build_workspace(const runtime::CellConfig& cell) {
  std::vector<voxel::LayerProfile> profiles;
  for (const auto& object : cell.objects) profiles.push_back(profile_of(object.profile));
  const voxel::GridSpec grid = voxel::grid_over(cell.min_m, cell.max_m, cell.voxel_size_m);
  voxel::Workspace workspace(grid, value_or_throw(voxel::make_palette(profiles), cell.file.string() + ": objects: "));
  std::vector<voxel::ObjectBricks> bricks;
  std::vector<voxel::CodeTable> codes;
  for (std::size_t i = 0; i < cell.objects.size(); ++i) {
    const runtime::ObjectConfig& object = cell.objects[i];
    const std::string place = cell.file.string() + ": objects[" + std::to_string(i) + "]: ";
    geometry::MeshImportOptions import;
    import.scale = object.mesh_scale;
    import.y_up = object.y_up;
    const auto mesh = value_or_throw(geometry::load_mesh(object.mesh, import), place);
    const voxel::Body body{object.name, static_cast<std::uint16_t>(i + 1), mesh.transformed(object.X_WO),
                           profiles[i]};
    bricks.push_back(value_or_throw(voxel::activate_object(body, grid), place).bricks);
    codes.push_back(voxel::code_table(profiles[i], workspace.palette()));
  }
  std::vector<voxel::MergeEntry> entries;
  for (std::size_t i = 0; i < bricks.size(); ++i) entries.push_back({&bricks[i], static_cast<std::uint16_t>(i + 1), &codes[i]});
  voxel::merge_bricks(voxel::MergeLaw::kHighestViscosity, entries, voxel::keys_of(entries), workspace);
  workspace.version = 1;
  return workspace;
}

}  // namespace phantom::phantom_sensing
