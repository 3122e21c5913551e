#include "common/fusion/camera_scene.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "common/geometry/point_triangle.hpp"
#include "common/geometry/ray_triangle.hpp"

namespace phantom::fusion {

CameraScene::CameraScene(const std::vector<Object>& objects) {
  std::vector<Triangle> triangles;
  geometry::TriangleMesh all;
  for (const Object& object : objects) {
    for (const auto& corners : object.mesh_W.triangles) {
      const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
        return object.mesh_W.vertices_m[corners[i]].cast<double>();
      };
      triangles.push_back({corner(0), corner(1), corner(2), object.specular});
    }
    all.append(object.mesh_W);
  }
  tree_ = geometry::BoxTree(geometry::triangle_boxes(all));
  for (const std::uint32_t item : tree_.items()) triangles_.push_back(triangles[item]);
}

std::optional<CameraScene::Hit> CameraScene::first_hit(const Eigen::Vector3d& origin_W_m,
                                                       const Eigen::Vector3d& direction_W, double from,
                                                       double to) const {
  const Triangle* nearest = nullptr;
  double until = to;
  tree_.along_ray(origin_W_m, direction_W, from, until, [&](std::uint32_t place) {
    const Triangle& t = triangles_[place];
    const auto s = geometry::ray_meets_triangle(origin_W_m, direction_W, t.a, t.b, t.c);
    if (!s || *s <= from || *s >= until) return;
    until = *s;
    nearest = &t;
  });
  if (nearest == nullptr) return std::nullopt;
  Eigen::Vector3d normal = (nearest->b - nearest->a).cross(nearest->c - nearest->a).normalized();
  if (normal.dot(direction_W) > 0.0) normal = -normal;
  return Hit{until, normal, nearest->specular};
}

double CameraScene::distance_m(const Eigen::Vector3d& p_W_m, double limit_m) const {
  double square = limit_m * limit_m;
  tree_.near(p_W_m, square, [&](std::uint32_t place) {
    const Triangle& t = triangles_[place];
    square =
        std::min(square, (geometry::closest_point_on_triangle(p_W_m, t.a, t.b, t.c) - p_W_m).squaredNorm());
  });
  return std::sqrt(square);
}

SeenPixel CameraScene::see(const PinholeCamera& camera, const Eigen::Vector3d& eye_W_m,
                           const Eigen::Vector3d& direction_W) const {
  // The direction's z in C is 1: s is the depth.
  const auto hit = first_hit(eye_W_m, direction_W, camera.min_depth_m, camera.max_depth_m);
  if (!hit) return {};
  const double length = direction_W.norm();
  SeenPixel seen{static_cast<float>(hit->s), static_cast<float>(-hit->normal.dot(direction_W) / length), 0.0F,
                 hit->specular};
  if (!hit->specular) return seen;
  const Eigen::Vector3d mirrored = direction_W - 2.0 * hit->normal.dot(direction_W) * hit->normal;
  constexpr double kOffSurface = 1e-6;
  const auto beyond =
      first_hit(eye_W_m + hit->s * direction_W, mirrored, kOffSurface, camera.max_depth_m - hit->s);
  if (beyond) seen.mirrored_depth_m = static_cast<float>(hit->s + beyond->s);  // the way of the light
  return seen;
}

void CameraScene::render(const PinholeCamera& camera, const geometry::Pose& X_WC,
                         std::vector<SeenPixel>& seen) const {
  seen.resize(camera.pixels());
  std::size_t i = 0;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u)
      seen[i++] = see(camera, X_WC.translation_m, X_WC.rotation * camera.direction(u, v));
  }
}

}  // namespace phantom::fusion
