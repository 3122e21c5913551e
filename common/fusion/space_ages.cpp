#include "common/fusion/space_ages.hpp"

#include <algorithm>

namespace phantom::fusion {
namespace {

using workspace::Index3;
using workspace::VoxelBox;

constexpr std::int32_t kCube_vox = 32;

VoxelBox cubes_of(const workspace::GridSpec& grid, std::int32_t cube_vox) {
  const auto count = [cube_vox](std::int32_t voxels) { return (voxels + cube_vox - 1) / cube_vox; };
  return {{0, 0, 0}, {count(grid.size_vox[0]), count(grid.size_vox[1]), count(grid.size_vox[2])}};
}

}  // namespace

SpaceAges space_ages(const Fusion& fusion, double now_s, std::size_t max_cubes,
                     std::span<const std::uint8_t> left_out) {
  SpaceAges ages{kCube_vox, cubes_of(fusion.grid(), kCube_vox), {}};
  while (ages.cubes.voxel_count() > max_cubes) {
    ages.cube_vox *= 2;
    ages.cubes = cubes_of(fusion.grid(), ages.cube_vox);
  }
  const VoxelBox blocks = blocks_of(fusion.grid());
  const std::int32_t edge = ages.cube_vox / kBlockEdge;
  std::vector<double> seen_s;
  ages.cubes.for_each([&](Index3 cube) {
    seen_s.clear();
    VoxelBox{edge * cube, {edge, edge, edge}}.intersection(blocks).for_each([&](Index3 block) {
      if (left_out.empty() || left_out[blocks.index(block)] == 0) seen_s.push_back(fusion.seen_s(block));
    });
    if (seen_s.empty()) {
      ages.ages_s.push_back(0.0);
      return;
    }
    const auto quarter = seen_s.begin() + static_cast<std::ptrdiff_t>((seen_s.size() - 1) / 4);
    std::ranges::nth_element(seen_s, quarter, std::ranges::greater());
    ages.ages_s.push_back(*quarter < 0.0 ? SpaceAges::kNever : std::max(0.0, now_s - *quarter));
  });
  return ages;
}

}  // namespace phantom::fusion
