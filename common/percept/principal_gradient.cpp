#include "common/percept/principal_gradient.hpp"

#include <algorithm>

namespace phantom::percept {
namespace {

/// Sum of the offsets of the voxels that hold one extreme code. Integers make the offsets of equal zones
/// cancel exactly.
struct Extreme {
  int code;
  std::int64_t x = 0, y = 0, z = 0, count = 0;

  void add(workspace::Index3 offset) noexcept {
    x += offset.x;
    y += offset.y;
    z += offset.z;
    ++count;
  }
  Eigen::Vector3d centroid() const noexcept {
    return Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) /
           static_cast<double>(count);
  }
};

}  // namespace

ClusterZone::ClusterZone(int reach_vox, ZoneShape shape) {
  const int m = std::clamp(reach_vox, 1, 15);
  for (int z = -m; z <= m; ++z) {
    for (int y = -m; y <= m; ++y) {
      for (int x = -m; x <= m; ++x) {
        if (shape == ZoneShape::kCube || x * x + y * y + z * z <= m * m) offsets_.push_back({x, y, z});
      }
    }
  }
}

PrincipalGradient ClusterZone::gradient(const workspace::Workspace& workspace, workspace::Index3 centre,
                                        std::size_t link, const AllowedContact& allowed) const noexcept {
  Extreme high{-1}, low{256};
  const bool mutes = allowed.concerns(link);
  for (const workspace::Index3 offset : offsets_) {
    const workspace::Index3 at{centre.x + offset.x, centre.y + offset.y, centre.z + offset.z};
    int code = workspace.mu_code(at);
    if (mutes && code != 0 && allowed.mutes(link, workspace.object(at))) code = 0;
    if (code > high.code) high = {code};
    if (code < low.code) low = {code};
    if (code == high.code) high.add(offset);
    if (code == low.code) low.add(offset);
  }
  PrincipalGradient result;
  result.greatest = static_cast<double>(workspace.palette()[static_cast<std::size_t>(high.code)]);
  result.least = static_cast<double>(workspace.palette()[static_cast<std::size_t>(low.code)]);
  if (high.code == low.code) return result;
  result.strength = result.greatest - result.least;
  result.pgv_W_m = workspace.grid().voxel_size_m.sides_m().cwiseProduct(high.centroid() - low.centroid());
  return result;
}

}  // namespace phantom::percept
