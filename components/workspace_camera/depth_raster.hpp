#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/fusion/depth_image.hpp"
#include "common/geometry/mesh/mesh.hpp"

namespace phantom::workspace_camera {

/// Nearest depth of a triangle that is drawn.
inline constexpr double kNearest_m = 0.02;

/// Calls draw(pixel, depth_m, cos_incidence) for each pixel whose centre a triangle of the mesh covers,
/// nearer than max_depth_m, whatever is in front. `X_CM`: mesh in the camera's frame. Triangles that reach
/// nearer to the camera than kNearest_m are left out. `corners_m` is memory for the corners in the camera's
/// frame. Allocates only for more corners than it held before.
template <class Draw>
void draw_mesh(const geometry::TriangleMesh& mesh, const geometry::Pose& X_CM,
               const fusion::PinholeCamera& camera, std::vector<Eigen::Vector3d>& corners_m, Draw draw) {
  corners_m.clear();
  for (const auto& vertex : mesh.vertices_m)
    corners_m.push_back(X_CM.rotation * vertex.template cast<double>() + X_CM.translation_m);
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = corners_m[triangle[0]], &b = corners_m[triangle[1]],
                          &c = corners_m[triangle[2]];
    if (std::min({a.z(), b.z(), c.z()}) < kNearest_m || std::min({a.z(), b.z(), c.z()}) > camera.max_depth_m)
      continue;
    const auto pixel_of = [&camera](const Eigen::Vector3d& p) {
      return Eigen::Vector2d(camera.fx_px * p.x() / p.z() + camera.cx_px,
                             camera.fy_px * p.y() / p.z() + camera.cy_px);
    };
    const Eigen::Vector2d p = pixel_of(a), q = pixel_of(b), r = pixel_of(c);
    const auto first = [](double x, double y, double z) {
      return std::max(0.0, std::ceil(std::min({x, y, z})));
    };
    const auto last = [](double x, double y, double z, int size) {
      return std::min(size - 1.0, std::floor(std::max({x, y, z})));
    };
    const auto u0 = static_cast<int>(std::min(first(p.x(), q.x(), r.x()), double{fusion::kMaxImageEdge_px}));
    const auto v0 = static_cast<int>(std::min(first(p.y(), q.y(), r.y()), double{fusion::kMaxImageEdge_px}));
    const auto u1 = static_cast<int>(std::max(last(p.x(), q.x(), r.x(), camera.width_px), -1.0));
    const auto v1 = static_cast<int>(std::max(last(p.y(), q.y(), r.y(), camera.height_px), -1.0));
    const auto cross = [](const Eigen::Vector2d& x, const Eigen::Vector2d& y) {
      return x.x() * y.y() - x.y() * y.x();
    };
    const double area = cross(q - p, r - p);
    if (std::abs(area) < 1e-12) continue;
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    const double length = normal.norm();
    for (int v = v0; v <= v1; ++v) {
      for (int u = u0; u <= u1; ++u) {
        const Eigen::Vector2d at(u, v);
        const double wa = cross(q - at, r - at) / area, wb = cross(r - at, p - at) / area, wc = 1.0 - wa - wb;
        if (wa < 0.0 || wb < 0.0 || wc < 0.0) continue;
        const double depth_m = 1.0 / (wa / a.z() + wb / b.z() + wc / c.z());
        if (depth_m > camera.max_depth_m) continue;
        const Eigen::Vector3d ray = camera.direction(u, v);
        const double cosine = length > 0.0 ? std::abs(normal.dot(ray)) / (length * ray.norm()) : 0.0;
        draw(static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width_px) +
                 static_cast<std::size_t>(u),
             depth_m, cosine);
      }
    }
  }
}

}  // namespace phantom::workspace_camera
