#include "tests/experiments/percept/outlines.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/geometry/point_triangle.hpp"

namespace phantom::experiments {

using Eigen::Vector2d;

void for_each_edge(const Outline& outline, const std::function<void(const Vector2d&, const Vector2d&)>& f) {
  for (const auto& loop : outline) {
    for (std::size_t i = 0; i < loop.size(); ++i) f(loop[i], loop[(i + 1) % loop.size()]);
  }
}

Vector2d outward(const Vector2d& a, const Vector2d& b) {
  return Vector2d(b.y() - a.y(), a.x() - b.x()).normalized();
}

bool is_inside(const Outline& outline, const Vector2d& p) {
  bool inside = false;
  for_each_edge(outline, [&](const Vector2d& a, const Vector2d& b) {
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  });
  return inside;
}

double distance_to(const Outline& outline, const Vector2d& p) {
  const Eigen::Vector3d p3(p.x(), p.y(), 0.0);
  double nearest = std::numeric_limits<double>::infinity();
  for_each_edge(outline, [&](const Vector2d& a, const Vector2d& b) {
    const Eigen::Vector3d a3(a.x(), a.y(), 0.0), b3(b.x(), b.y(), 0.0);
    nearest = std::min(nearest, (geometry::closest_point_on_segment(p3, a3, b3) - p3).norm());
  });
  return nearest;
}

double perimeter_of(const Outline& outline) {
  double sum = 0.0;
  for_each_edge(outline, [&](const Vector2d& a, const Vector2d& b) { sum += (b - a).norm(); });
  return sum;
}

std::vector<Vector2d> circle(double radius, int sides) {
  std::vector<Vector2d> corners;
  for (int i = 0; i < sides; ++i) {
    const double psi = 2.0 * std::numbers::pi * i / sides;
    corners.emplace_back(radius * std::cos(psi), radius * std::sin(psi));
  }
  return corners;
}

Outline moved_out(Outline outline, double offset) {
  for (auto& loop : outline) {
    const auto original = loop;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2d n = outward(original[(i + loop.size() - 1) % loop.size()], original[i]),
                     m = outward(original[i], original[(i + 1) % loop.size()]);
      loop[i] += offset / (1.0 + n.dot(m)) * (n + m);
    }
  }
  return outline;
}

Outline scaled_up(Outline outline, double offset) {
  Eigen::AlignedBox2d box;
  for_each_edge(outline, [&](const Vector2d& a, const Vector2d&) { box.extend(a); });
  const Vector2d middle = box.center();
  const double factor = 1.0 + offset / (0.5 * box.sizes().maxCoeff());
  for (auto& loop : outline) {
    for (Vector2d& corner : loop) corner = middle + factor * (corner - middle);
  }
  return outline;
}

}  // namespace phantom::experiments
