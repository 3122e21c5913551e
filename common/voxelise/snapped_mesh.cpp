#include "common/voxelise/snapped_mesh.hpp"

#include <algorithm>
#include <atomic>

#include "common/core/parallel.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/voxelise/snapped_mesh.cpp"
#include <hwy/foreach_target.h>  // once per instruction set
// (keep this order)
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace phantom::voxelise::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Snaps `count` vertices of three floats each. Returns the greatest absolute coordinate.
double SnapVertices(const float* vertices_m, std::size_t count, const Lattice& lattice,
                    SnappedPoint* points) {
  const hn::CappedTag<double, 4> d;
  const hn::Rebind<float, decltype(d)> floats;
  const hn::Rebind<std::int32_t, decltype(d)> ints;
  const auto rounder = hn::Set(d, 0x1.8p52);  // adding it rounds to a whole number, ties to even
  const auto limit = hn::Set(d, 2.0 * static_cast<double>(kReach));
  auto farthest = hn::Zero(d);
  const auto snap = [&](const float* from, std::int32_t* to) HWY_ATTR {
    for (std::size_t part = 0; part < 4; part += hn::Lanes(d)) {
      const auto vertex = hn::PromoteTo(d, hn::LoadU(floats, from + part));
      const auto voxels =
          hn::Div(hn::Sub(vertex, hn::Load(d, lattice.origin_m + part)), hn::Load(d, lattice.voxel_m + part));
      const auto p =
          hn::Mul(hn::Sub(voxels, hn::Load(d, lattice.corner + part)), hn::Load(d, lattice.scale + part));
      const auto held = hn::Max(hn::Min(p, limit), hn::Neg(limit));
      farthest = hn::Max(farthest, hn::Abs(held));
      hn::StoreU(hn::DemoteTo(ints, hn::Sub(hn::Add(held, rounder), rounder)), ints, to + part);
    }
  };
  // The fourth float read belongs to the next vertex and is scaled to 0. The last vertex has no next one.
  for (std::size_t i = 0; i + 1 < count; ++i) snap(vertices_m + 3 * i, points[i].data());
  if (count > 0) {
    const float* const last = vertices_m + 3 * (count - 1);
    const float vertex[4] = {last[0], last[1], last[2], 0.0F};
    snap(vertex, points[count - 1].data());
  }
  return hn::GetLane(hn::MaxOfLanes(d, farthest));
}

}  // namespace phantom::voxelise::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace phantom::voxelise::detail {

HWY_EXPORT(SnapVertices);

bool snap(std::span<const Eigen::Vector3f> vertices_m, const Lattice& lattice, int threads,
          std::vector<SnappedPoint>& points) {
  constexpr std::size_t kBatch = 1U << 15;
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  points.resize(vertices_m.size());
  std::atomic<bool> within = true;
  core::parallel_for(threads, (points.size() + kBatch - 1) / kBatch, [&](std::size_t batch, std::size_t) {
    const std::size_t first = batch * kBatch, count = std::min(points.size() - first, kBatch);
    const double farthest =
        HWY_DYNAMIC_DISPATCH(SnapVertices)(vertices_m[first].data(), count, lattice, points.data() + first);
    if (!(farthest < static_cast<double>(kReach))) within = false;
  });
  return within;
}

std::uint64_t lines_reached(int axis, const SnappedMesh& mesh, const std::array<std::int32_t, 3>& size) {
  const std::size_t across[2] = {axis == 0 ? 1U : 0U, axis == 2 ? 1U : 2U};
  std::uint64_t lines = 0;
  for (const Corners& corners : mesh.triangles) {
    std::int64_t reached = 1;
    for (const std::size_t along : across) {
      const auto [least, most] = std::minmax(
          {mesh.points[corners[0]][along], mesh.points[corners[1]][along], mesh.points[corners[2]][along]});
      const std::int32_t first = std::max(least >> kSubBits, 0),
                         last = std::min(most >> kSubBits, size[along] - 1);
      reached *= std::max(last - first + 1, 0);
    }
    lines += static_cast<std::uint64_t>(reached);
  }
  return lines;
}

}  // namespace phantom::voxelise::detail
#endif
