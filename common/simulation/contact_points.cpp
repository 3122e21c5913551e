#include "common/simulation/contact_points.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/errors.hpp"

namespace phantom::simulation {
namespace {

double outer_radius_m(double radius_m, const std::vector<robot::PolygonPoint>& polygon) {
  for (const robot::PolygonPoint& corner : polygon) radius_m = std::max(radius_m, corner.r_m);
  return radius_m;
}

void append_segment(const robot::SkinSegment& segment, std::size_t link, const geometry::Pose& X_link_frame,
                    const Eigen::Vector3d& closing_m, double pitch_m, std::vector<ContactPoint>& points) {
  const Eigen::Vector3d axis = (segment.to_m - segment.from_m).normalized();
  const Eigen::Vector3d side = axis.unitOrthogonal();
  const Eigen::Vector3d other = axis.cross(side);
  const double from_radius_m = outer_radius_m(segment.from_radius_m, segment.from_polygon);
  const double to_radius_m = segment.to_polygon.empty() && !segment.from_polygon.empty()
                                 ? from_radius_m
                                 : outer_radius_m(segment.to_radius_m, segment.to_polygon);
  const double length_m = (segment.to_m - segment.from_m).norm();
  const int rings = std::max(2, static_cast<int>(std::ceil(length_m / pitch_m)) + 1);
  for (int r = 0; r < rings; ++r) {
    const double share = static_cast<double>(r) / (rings - 1);
    const Eigen::Vector3d centre_m = segment.from_m + share * (segment.to_m - segment.from_m);
    const double radius_m = from_radius_m + share * (to_radius_m - from_radius_m);
    const int sides = std::max(6, static_cast<int>(std::ceil(2 * std::numbers::pi * radius_m / pitch_m)));
    for (int s = 0; s < sides; ++s) {
      const double angle = segment.spin_rad + 2 * std::numbers::pi * s / sides;
      points.push_back(
          {link, X_link_frame * (centre_m + radius_m * (std::cos(angle) * side + std::sin(angle) * other)),
           closing_m});
    }
    if (r == 0 || r == rings - 1) points.push_back({link, X_link_frame * centre_m, closing_m});
  }
}

/// Appends the points of lines and meshes; those of segments are made elsewhere.
void append_lines_and_meshes(const robot::SerialArm& arm, const robot::LinkSkin& skin, double pitch_m,
                             std::vector<ContactPoint>& points) {
  if (skin.axes.empty() && skin.meshes.empty()) return;
  const robot::LinkSkin part{skin.link, {}, skin.axes, skin.meshes, skin.closing_m};
  const auto layout = robot::lay_out_skin(
      arm, {part}, {.voxel_size_m = pitch_m, .normalisation = robot::Normalisation::kNone});
  if (!layout) throw core::ConfigError("skin: " + layout.status().message());
  for (std::size_t i = 0; i < layout->size(); ++i)
    points.push_back(
        {layout->link_of(i), layout->position(i), layout->position(i, 1.0) - layout->position(i)});
}

}  // namespace

std::vector<ContactPoint> contact_points(const robot::SerialArm& arm,
                                         const std::vector<robot::LinkSkin>& skins, double pitch_m,
                                         int max_points) {
  std::vector<ContactPoint> points;
  for (;; pitch_m *= 1.1) {
    points.clear();
    for (const auto& skin : skins) {
      const auto frame = arm.find_frame(skin.link);
      if (!frame)
        throw core::ConfigError("skin: no link called '" + skin.link +
                                "' in the arm; allowed: the URDF's link names");
      for (const auto& segment : skin.segments)
        append_segment(segment, frame->first, frame->second, frame->second.rotation * skin.closing_m, pitch_m,
                       points);
      append_lines_and_meshes(arm, skin, pitch_m, points);
    }
    // Above a pitch of one metre the number of points no longer falls: the skin has more segments than
    // `max_points`.
    if (static_cast<int>(points.size()) <= max_points || pitch_m > 1.0) return points;
  }
}

}  // namespace phantom::simulation
