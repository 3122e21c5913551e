#include <algorithm>
#include <cmath>

#include "common/voxel/snapped_mesh.hpp"

namespace phantom::voxel::detail {
namespace {

struct Range {
  std::int64_t first, last;
};

/// The triangle's shadow on the plane (u, v), as seen by whole squares of the grid.
class Shadow {
 public:
  Shadow(const SnappedTriangle& t, int u, int v) : u_(u), v_(v) {
    const std::int64_t area =
        (t[1][u] - t[0][u]) * (t[2][v] - t[0][v]) - (t[2][u] - t[0][u]) * (t[1][v] - t[0][v]);
    // A shadow without area is a segment: its edges run both ways, so both its sides are tested.
    for (int i = 0; i < 3; ++i) {
      const SnappedPoint& from = t[area < 0 ? (i + 1) % 3 : i];
      const SnappedPoint& to = t[area < 0 ? i : (i + 1) % 3];
      const std::int64_t du = to[u] - from[u], dv = to[v] - from[v];
      step_u_[i] = -dv * kSub;
      step_v_[i] = du * kSub;
      // Value at the square's corner that lies farthest to the left of the edge.
      at_origin_[i] = dv * from[u] - du * from[v] + std::max<std::int64_t>(0, step_u_[i]) +
                      std::max<std::int64_t>(0, step_v_[i]);
    }
  }
  /// Whether the closed square of voxel (…u…v…) meets the shadow's edges' left sides.
  bool meets(const std::array<std::int64_t, 3>& voxel) const {
    for (int i = 0; i < 3; ++i) {
      if (at_origin_[i] + voxel[u_] * step_u_[i] + voxel[v_] * step_v_[i] < 0) return false;
    }
    return true;
  }

 private:
  int u_, v_;
  std::int64_t step_u_[3], step_v_[3], at_origin_[3];
};

/// Voxels along w that the triangle's plane can pass through above one square, never too few.
class Plane {
 public:
  Plane(const SnappedTriangle& t, const std::array<double, 3>& normal, int w)
      : u_((w + 1) % 3), v_((w + 2) % 3) {
    const double scale = normal[w] == 0.0 ? 0.0 : 1.0 / normal[w];
    slope_u_ = -normal[u_] * scale;
    slope_v_ = -normal[v_] * scale;
    const double base = static_cast<double>(t[0][w]) - slope_u_ * static_cast<double>(t[0][u_]) -
                        slope_v_ * static_cast<double>(t[0][v_]);
    low_ = base / kSub + std::min(0.0, slope_u_) + std::min(0.0, slope_v_) - kMargin;
    high_ = base / kSub + std::max(0.0, slope_u_) + std::max(0.0, slope_v_) + kMargin;
  }
  Range above(std::int64_t u, std::int64_t v) const {
    const double here = slope_u_ * static_cast<double>(u) + slope_v_ * static_cast<double>(v);
    return {static_cast<std::int64_t>(std::floor(here + low_)),
            static_cast<std::int64_t>(std::floor(here + high_))};
  }

 private:
  static constexpr double kMargin =
      1e-7;  // voxels; far above the rounding of doubles here, below the snapping
  int u_, v_;
  double slope_u_, slope_v_, low_, high_;
};

std::array<double, 3> normal_of(const SnappedTriangle& t) {
  std::array<double, 3> b{}, c{};
  for (int i = 0; i < 3; ++i) {
    b[i] = static_cast<double>(t[1][i] - t[0][i]);
    c[i] = static_cast<double>(t[2][i] - t[0][i]);
  }
  return {b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]};
}

void set(BitVolume& volume, const std::array<std::int64_t, 3>& voxel) {
  volume.set(static_cast<std::int32_t>(voxel[0]), static_cast<std::int32_t>(voxel[1]),
             static_cast<std::int32_t>(voxel[2]));
}

}  // namespace

void mark_triangle(const SnappedTriangle& t, BitVolume& boundary) {
  std::array<Range, 3> range{};
  int wide_axes = 0;
  for (int i = 0; i < 3; ++i) {
    const auto [low, high] = std::minmax({t[0][i], t[1][i], t[2][i]});
    range[i] = {low >> kSubBits, high >> kSubBits};
    if (range[i].first != range[i].last) ++wide_axes;
    range[i].first = std::max<std::int64_t>(0, range[i].first);
    range[i].last = std::min<std::int64_t>(boundary.size()[static_cast<std::size_t>(i)] - 1, range[i].last);
    if (range[i].first > range[i].last) return;
  }
  std::array<std::int64_t, 3> voxel{};
  if (wide_axes <= 1) {  // a row of voxels: the triangle is connected, so it passes through each
    for (voxel[2] = range[2].first; voxel[2] <= range[2].last; ++voxel[2]) {
      for (voxel[1] = range[1].first; voxel[1] <= range[1].last; ++voxel[1]) {
        for (voxel[0] = range[0].first; voxel[0] <= range[0].last; ++voxel[0]) set(boundary, voxel);
      }
    }
    return;
  }
  const std::array<double, 3> normal = normal_of(t);
  int w = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(normal[i]) > std::abs(normal[w])) w = i;
  }
  const int u = (w + 1) % 3, v = (w + 2) % 3;
  const Plane plane(t, normal, w);
  const Shadow along_w(t, u, v), along_u(t, v, w), along_v(t, w, u);
  const bool flat = normal[w] == 0.0;  // no plane: a segment or a point
  for (voxel[v] = range[v].first; voxel[v] <= range[v].last; ++voxel[v]) {
    for (voxel[u] = range[u].first; voxel[u] <= range[u].last; ++voxel[u]) {
      if (!along_w.meets(voxel)) continue;
      Range height = range[w];
      if (!flat) {
        const Range pierced = plane.above(voxel[u], voxel[v]);
        height = {std::max(height.first, pierced.first), std::min(height.last, pierced.last)};
      }
      for (voxel[w] = height.first; voxel[w] <= height.last; ++voxel[w]) {
        if (along_u.meets(voxel) && along_v.meets(voxel)) set(boundary, voxel);
      }
    }
  }
}

}  // namespace phantom::voxel::detail
