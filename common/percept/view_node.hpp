#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

namespace phantom::percept {

/// Where to look from: nodes of a cube around the look-at point, its axes parallel to W (thesis fig. 6.22).
/// The numbers are those of operator_command. Corners: 1 to 4 above, 5 to 8 below, each set counter-clockwise
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

/// Unit vector from the look-at point to the node, in W; zero for kAutomatic. Real-time safe: yes.
Eigen::Vector3d node_direction(ViewNode node) noexcept;
/// "1" … "8", "N", "S", "E", "W", "T", "B"; "auto". Real-time safe: yes.
const char* node_name(ViewNode node) noexcept;
/// The node with an operator_command's number; nothing unless it is a whole number 0…14. Real-time safe: yes.
std::optional<ViewNode> node_from_number(double number) noexcept;
/// The inverse of node_name(). Real-time safe: yes.
std::optional<ViewNode> node_from_name(std::string_view name) noexcept;

/// Unit vector of W: azimuth from x towards y, elevation above the floor. Real-time safe: yes.
Eigen::Vector3d direction_at(double azimuth_rad, double elevation_rad) noexcept;

/// How a view stands that is taken from `backward` (unit vector of W from what is looked at to the camera):
/// rows right, up and backward, so that the matrix turns vectors of W into the camera's frame. Up is z of W;
/// looking (nearly) straight up or down, up is y of W. Real-time safe: yes.
Eigen::Matrix3d view_axes(const Eigen::Vector3d& backward) noexcept;

}  // namespace phantom::percept
