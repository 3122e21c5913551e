#include "common/workspace/thin_layers.hpp"

#include <cmath>

#include "common/core/text.hpp"

namespace phantom::workspace {
namespace {

constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// Whether a voxel's centre lies in (from, to] shortest sides from a solid voxel's, straight along an axis.
bool has_voxel(double from, double to, double side) {
  constexpr double kRounding = 1e-9;
  return std::floor(to * (1.0 + kRounding) / side) * side > from * (1.0 + kRounding);
}

/// Numbers of layers, for a message.
struct ThinLayers {
  std::string thin, lost;
};

/// Returns the layers outside or inside a body that are thinner than `side`, and those of them without a
/// voxel along it. `from_vox`: where the first begins. Both in shortest sides.
ThinLayers thin_layers(const std::vector<int>& thickness_vox, int from_vox, double side) {
  ThinLayers found;
  for (std::size_t i = 0; i < thickness_vox.size(); from_vox += thickness_vox[i++]) {
    if (thickness_vox[i] >= side * (1.0 - 1e-9)) continue;
    core::add_to_list(found.thin, std::to_string(i + 1));
    if (!has_voxel(from_vox, from_vox + thickness_vox[i], side))
      core::add_to_list(found.lost, std::to_string(i + 1));
  }
  return found;
}

}  // namespace

core::Status check_layers(const LayerProfile& profile, const VoxelSize& size) {
  if (profile.method == LayerMethod::kDilation) return core::Status::ok();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double side = size.stretch()[static_cast<Eigen::Index>(axis)];
    if (has_voxel(profile.guard_vox, profile.reach_vox(), side)) continue;
    return core::Status::invalid_argument(core::formatted(
        "layer profile: layers and guard reach %g m, but a voxel is %g m long along %s, where no layer "
        "has one: nothing would be felt there before contact; allowed: layers that "
        "reach the voxel's longest side beyond the guard",
        profile.reach_vox() * size.reference_m(), size[axis], kAxisNames[axis]));
  }
  return core::Status::ok();
}

std::vector<std::string> thin_layer_notes(const LayerProfile& profile, const VoxelSize& size) {
  std::vector<std::string> notes;
  if (profile.method == LayerMethod::kDilation) return notes;
  const auto note = [&](const ThinLayers& found, std::size_t axis, const char* place) {
    if (found.thin.empty()) return;
    std::string text = core::formatted(
        "layers%s %s are thinner than a voxel is long along %s, %g m, and may be missing there", place,
        found.thin.c_str(), kAxisNames[axis], size[axis]);
    if (!found.lost.empty() && profile.method == LayerMethod::kDistance)
      text += "; straight along " + std::string(kAxisNames[axis]) + " these have no voxel: " + found.lost;
    notes.push_back(text);
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double side = size.stretch()[static_cast<Eigen::Index>(axis)];
    note(thin_layers(profile.thickness_vox, profile.guard_vox, side), axis, "");
    note(thin_layers(profile.inside_thickness_vox, 0, side), axis, " inside");
  }
  return notes;
}

}  // namespace phantom::workspace
