#include "common/fusion/fusion_parameters.hpp"

#include "common/core/text.hpp"
#include "common/fusion/change_gate.hpp"

namespace phantom::fusion {
namespace {

using core::formatted;
using core::Status;

Status check_grid(const workspace::GridSpec& grid) {
  if (Status checked = workspace::check_voxel_size(grid.voxel_size_m); !checked) return checked;
  if (!grid.voxel_size_m.is_cube())
    return Status::invalid_argument("fusion: the voxels are no cubes; allowed: one size along x, y and z");
  constexpr std::int32_t kMaxEdge = 1 << 14;
  for (const std::int32_t size : grid.size_vox) {
    if (size < 1 || size > kMaxEdge)
      return Status::invalid_argument(
          formatted("fusion: a grid of %d x %d x %d voxels; allowed: 1 to %d along each axis",
                    grid.size_vox[0], grid.size_vox[1], grid.size_vox[2], kMaxEdge));
  }
  if (grid.voxel_count() > kMaxFusionVoxels)
    return Status::invalid_argument(formatted("fusion: a grid of %lld voxels; allowed: %lld",
                                              static_cast<long long>(grid.voxel_count()),
                                              static_cast<long long>(kMaxFusionVoxels)));
  if (!(grid.origin_m.cwiseAbs().maxCoeff() <= kMaxCameraDistance_m))
    return Status::invalid_argument(formatted("fusion: the grid's corner is %g m away; allowed: %g",
                                              grid.origin_m.cwiseAbs().maxCoeff(), kMaxCameraDistance_m));
  return Status::ok();
}

}  // namespace

Status check_parameters(const FusionParameters& p) {
  if (Status checked = check_grid(p.grid); !checked) return checked;
  struct Range {
    const char* name;
    double value, low, high;
  };
  const Range ranges[] = {
      {"truncation_vox", p.truncation_vox, 1.0, 16.0},
      {"hysteresis_vox", p.hysteresis_vox, 0.0, 1.0},
      {"shell_vox", p.shell_vox, 2.0 * p.hysteresis_vox, p.truncation_vox - p.hysteresis_vox},
      {"max_weight", static_cast<double>(p.max_weight), 8.0, 255.0},
      {"sigma.at_1m_m", p.sigma.at_1m_m, 0.0, 1.0},
      {"surprise_sigmas", p.surprise_sigmas, 0.0, 100.0},
      {"surprise_vox", p.surprise_vox, 0.0, 100.0},
      {"decision_sigma_vox", p.decision_sigma_vox, 0.01, 10.0},
      {"masks.edge_m", p.masks.edge_m, 0.0, 10.0},
      {"masks.edge_sigmas", p.masks.edge_sigmas, 0.0, 100.0},
      {"masks.arm_margin_m", p.masks.arm_margin_m, 0.0, 1.0},
      {"masks.arm_margin_px", static_cast<double>(p.masks.arm_margin_px), 0.0, 64.0},
      {"min_component_vox", static_cast<double>(p.min_component_vox), 1.0, double{kMaxSpeckle_vox}},
      {"max_blocks", static_cast<double>(p.max_blocks), 1.0, static_cast<double>(kMaxFusionBlocks)},
      {"unknown_regions", static_cast<double>(p.unknown_regions.size()), 0.0, double{kMaxUnknownRegions}}};
  for (const Range& range : ranges) {
    if (!(range.value >= range.low && range.value <= range.high))
      return Status::invalid_argument(
          formatted("fusion: %s is %g; allowed: %g to %g", range.name, range.value, range.low, range.high));
  }
  return Status::ok();
}

}  // namespace phantom::fusion
