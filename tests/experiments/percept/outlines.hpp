#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace phantom::experiments {

/// A level section of a body: closed polygons, the body on the left of each edge. Any unit.
using Outline = std::vector<std::vector<Eigen::Vector2d>>;

/// Calls f(a, b) for every edge from a to b.
void for_each_edge(const Outline& outline,
                   const std::function<void(const Eigen::Vector2d&, const Eigen::Vector2d&)>& f);
/// Unit normal of the edge from a to b, away from the body.
Eigen::Vector2d outward(const Eigen::Vector2d& a, const Eigen::Vector2d& b);
/// Whether a ray from the point meets an odd number of edges.
bool is_inside(const Outline& outline, const Eigen::Vector2d& p);
/// Distance to the nearest edge, inside or outside.
double distance_to(const Outline& outline, const Eigen::Vector2d& p);
double perimeter_of(const Outline& outline);

/// Corners of a regular polygon on a circle around the origin, counter-clockwise, the first on x.
std::vector<Eigen::Vector2d> circle(double radius, int sides);

/// The outline with every edge moved outwards by `offset` and met with its neighbours' (thesis figure 4.19).
Outline moved_out(Outline outline, double offset);
/// The outline scaled about the middle of its box, so that its farthest edge moves out by `offset` (figure
/// 4.18).
Outline scaled_up(Outline outline, double offset);

}  // namespace phantom::experiments
