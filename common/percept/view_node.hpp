#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

namespace phantom::percept {

/// Viewpoints: the nodes of a cube around the look-at point, with axes parallel to W (thesis fig. 6.22). The
/// numbers are those of operator_command. Corners 1 to 4 are above, 5 to 8 below, each set counter-clockwise
/// from +x+y.
enum class ViewNode : int {
  kAutomatic = 0,
  kCorner1 = 1,
  kCorner2,
  kCorner3,
  kCorner4,
  kCorner5,
  kCorner6,
  kCorner7,
  kCorner8,
  kNorth,   ///< +y
  kSouth,   ///< −y
  kEast,    ///< +x
  kWest,    ///< −x
  kTop,     ///< +z
  kBottom,  ///< −z
};
inline constexpr int kNodeCount = 14;

/// Returns the unit vector from the look-at point to the node, in W; zero for kAutomatic. Real-time safe:
/// yes.
Eigen::Vector3d node_direction(ViewNode node) noexcept;
/// Returns "1" … "8", "N", "S", "E", "W", "T", "B" or "auto". Real-time safe: yes.
const char* node_name(ViewNode node) noexcept;
/// Returns the node with an operator_command's number, or none unless it is a whole number 0…14. Real-time
/// safe: yes.
std::optional<ViewNode> node_from_number(double number) noexcept;
/// Returns the node with this name, the inverse of node_name(). Real-time safe: yes.
std::optional<ViewNode> node_from_name(std::string_view name) noexcept;

/// Returns the unit vector in W with this azimuth (from x towards y) and elevation above the floor. Real-time
/// safe: yes.
Eigen::Vector3d direction_at(double azimuth_rad, double elevation_rad) noexcept;

/// Returns the orientation of a camera. `backward` is the unit vector in W from the look-at point to the
/// camera. The rows are right, up and backward, so the matrix turns vectors of W into the camera's frame. Up
/// is z of W or, looking (nearly) straight up or down, y of W. Real-time safe: yes.
Eigen::Matrix3d view_axes(const Eigen::Vector3d& backward) noexcept;

}  // namespace phantom::percept
