#pragma once

#include <array>
#include <optional>

#include "common/core/clock.hpp"
#include "common/percept/view_node.hpp"

namespace phantom::audio_percept {

using Vector3 = std::array<double, 3>;

/// Where the listener is and how it is oriented: facing into the view that the operator looks at.
struct ListenerConfig {
  Vector3 position_m{0.0, 0.0, 0.8};      ///< in W; directions are relative to this point
  std::optional<percept::ViewNode> view;  ///< until the operator chooses one; none: the main view
  bool follow_viewer = true;              ///< whether the view that the viewer reports turns the listener
  core::Nanoseconds view_timeout_ns = core::kNsPerSecond;  ///< a reported view older than this does not count
  bool follow_operator = true;  ///< whether the view node that the operator chooses turns the listener
  /// Azimuth of the main view's camera, seen from the listener: from x towards y.
  double main_azimuth_rad = 0.0;
  double main_elevation_rad = 0.0;  ///< of the same camera, above the floor
  double near_m = 0.15;             ///< a sound closer than this comes from all around
};

/// The orientation of the listener: its right, up and backward as unit vectors of W.
using ListenerAxes = std::array<Vector3, 3>;

/// Returns the orientation for the view from a node, or for the main view if there is none. Real-time safe:
/// yes.
ListenerAxes listener_axes(const ListenerConfig& listener, std::optional<percept::ViewNode> view) noexcept;

/// Returns `p_W_m` in the frame of the listener: x right, y up, z backward, metres. Real-time safe: yes.
Vector3 in_listener_frame(const ListenerConfig& listener, const ListenerAxes& axes,
                          const Vector3& p_W_m) noexcept;

/// Returns the azimuth, clockwise from straight ahead, seen from above: +90° is right. 0 for a point straight
/// above or below. Real-time safe: yes.
double azimuth_rad(const Vector3& p_listener_m) noexcept;
/// Returns the elevation above the horizontal plane of the listener. Real-time safe: yes.
double elevation_rad(const Vector3& p_listener_m) noexcept;

}  // namespace phantom::audio_percept
