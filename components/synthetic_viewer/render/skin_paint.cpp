#include "components/synthetic_viewer/render/skin_paint.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::synthetic_viewer {
namespace {

constexpr float kMaxCubes = 64.0F;

std::size_t place(const PaintVolume& volume, int x, int y, int z) {
  return static_cast<std::size_t>(x + volume.size[0] * (y + volume.size[1] * z));
}

/// Colours the cubes around a patch.
void splat(PaintVolume& volume, const SkinPatchSample& patch, float reach_m) {
  const Eigen::Vector3f middle_m(patch.middle_m[0], patch.middle_m[1], patch.middle_m[2]);
  const Eigen::Vector3f at = (middle_m - volume.corner_m) / volume.edge_m;
  const float reach = 2 * reach_m / volume.edge_m;
  std::array<int, 3> low{}, high{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    low[i] = std::max(0, static_cast<int>(std::ceil(at[axis] - reach - 0.5F)));
    high[i] = std::min(volume.size[i] - 1, static_cast<int>(std::floor(at[axis] + reach - 0.5F)));
  }
  for (int z = low[2]; z <= high[2]; ++z) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int x = low[0]; x <= high[0]; ++x) {
        const Eigen::Vector3f cube(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                                   static_cast<float>(z) + 0.5F);
        const float away = (cube - at).norm() * volume.edge_m / reach_m;  // 1: the patch's edge
        const float share = std::clamp(2 - away, 0.0F, 1.0F) * std::clamp(patch.closeness, 0.0F, 1.0F);
        std::uint8_t& byte = volume.closeness[place(volume, x, y, z)];
        byte = std::max(byte, static_cast<std::uint8_t>(std::lround(255 * share)));
      }
    }
  }
}

}  // namespace

PaintVolume paint_link(const geometry::BoundingBox& box, double patch_m,
                       const std::vector<SkinPatchSample>& patches, std::size_t link) {
  PaintVolume volume;
  if (box.empty() || !(patch_m > 0)) return volume;
  const auto reach_m = static_cast<float>(patch_m);
  const Eigen::Vector3f extent = box.max_m - box.min_m + Eigen::Vector3f::Constant(2 * reach_m);
  volume.edge_m = std::max(reach_m / 2, extent.maxCoeff() / kMaxCubes);
  volume.corner_m = box.min_m - Eigen::Vector3f::Constant(reach_m);
  std::size_t cubes = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int size = std::max(1, static_cast<int>(std::ceil(extent[axis] / volume.edge_m)));
    volume.size[static_cast<std::size_t>(axis)] = size;
    cubes *= static_cast<std::size_t>(size);
  }
  volume.closeness.assign(cubes, 0);
  for (const SkinPatchSample& patch : patches) {
    if (patch.link == link) splat(volume, patch, reach_m);
  }
  return volume;
}

}  // namespace phantom::synthetic_viewer
