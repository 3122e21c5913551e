#pragma once

#include <array>
#include <optional>

#include "common/core/clock.hpp"
#include "common/percept/view_node.hpp"

namespace phantom::audio_percept {

using Vector3 = std::array<double, 3>;

/// Where the operator's ears are and how they are oriented: facing into the view that the operator looks at.
struct ListenerConfig {
  Vector3 ears_m{0.0, 0.0, 0.8};          ///< in W; directions are relative to this point
  std::optional<percept::ViewNode> view;  ///< until the operator chooses one; none: the main view
  bool follow_viewer = true;              ///< whether the view that the viewer reports turns the ears
  core::Nanoseconds view_timeout_ns = core::kNsPerSecond;  ///< a reported view older than this does not count
  bool follow_operator = true;  ///< whether the view node that the operator chooses turns the ears
  /// Azimuth of the main view's camera, seen from the ears: from x towards y.
  double main_azimuth_rad = 0.0;
  double main_elevation_rad = 0.0;  ///< of the same camera, above the floor
  double near_m = 0.15;             ///< a sound closer than this comes from all around
};

/// The orientation of the ears: their right, up and backward as unit vectors of W.
using EarAxes = std::array<Vector3, 3>;

/// Returns the orientation for the view from a node, or for the main view if there is none. Real-time safe:
/// yes.
EarAxes ear_axes(const ListenerConfig& listener, std::optional<percept::ViewNode> view) noexcept;

/// Returns `p_W_m` in the frame of the ears: x right, y up, z backward, metres. Real-time safe: yes.
Vector3 heard_at(const ListenerConfig& listener, const EarAxes& axes, const Vector3& p_W_m) noexcept;

/// Returns the azimuth, clockwise from straight ahead, seen from above: +90° is right. 0 for a point straight
/// above or below. Real-time safe: yes.
double azimuth_rad(const Vector3& p_ears_m) noexcept;
/// Returns the elevation above the horizontal plane of the ears. Real-time safe: yes.
double elevation_rad(const Vector3& p_ears_m) noexcept;

}  // namespace phantom::audio_percept
