#include "common/geometry/mesh/weld.hpp"

#include <cmath>

namespace phantom::geometry {
namespace {

std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::uint64_t mask = (1U << 21U) - 1U;
  return (static_cast<std::uint64_t>(x) & mask) << 42U | (static_cast<std::uint64_t>(y) & mask) << 21U |
         (static_cast<std::uint64_t>(z) & mask);
}

}  // namespace

std::array<std::int64_t, 3> PointGrid::cell_of(const Eigen::Vector3d& p_m) const {
  return {static_cast<std::int64_t>(std::floor(p_m.x() / (2.0 * radius_m_))),
          static_cast<std::int64_t>(std::floor(p_m.y() / (2.0 * radius_m_))),
          static_cast<std::int64_t>(std::floor(p_m.z() / (2.0 * radius_m_)))};
}

void PointGrid::add(const Eigen::Vector3d& p_m, std::uint32_t index) {
  const auto at = cell_of(p_m);
  cells_[cell_key(at[0], at[1], at[2])].push_back({p_m, index});
}

std::optional<PointGrid::Near> PointGrid::nearest(const Eigen::Vector3d& p_m) const {
  const auto at = cell_of(p_m);
  std::array<std::int64_t, 3> other;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double share =
        p_m[static_cast<Eigen::Index>(axis)] / (2.0 * radius_m_) - static_cast<double>(at[axis]);
    other[axis] = at[axis] + (share < 0.5 ? -1 : 1);
  }
  std::optional<Near> best;
  double best_square = radius_m_ * radius_m_;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto found = cells_.find(cell_key(corner & 1 ? other[0] : at[0], corner & 2 ? other[1] : at[1],
                                            corner & 4 ? other[2] : at[2]));
    if (found == cells_.end()) continue;
    for (const auto& [point, index] : found->second) {
      const double square = (point - p_m).squaredNorm();
      const bool nearer = square < best_square || (square == best_square && (!best || index < best->index));
      if (nearer) best = Near{index, best_square = square};
    }
  }
  return best;
}

std::vector<std::uint32_t> weld(std::span<const Eigen::Vector3d> points_m, double tolerance_m) {
  PointGrid grid(tolerance_m);
  std::vector<std::uint32_t> first;
  first.reserve(points_m.size());
  for (const Eigen::Vector3d& p : points_m) {
    const auto index = static_cast<std::uint32_t>(first.size());
    const auto near = grid.nearest(p);
    if (!near) grid.add(p, index);
    first.push_back(near ? near->index : index);
  }
  return first;
}

}  // namespace phantom::geometry
