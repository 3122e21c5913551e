#pragma once

#include <array>
#include <optional>

#include "common/core/clock.hpp"
#include "common/percept/view_node.hpp"

namespace phantom::audio_percept {

using Vector3 = std::array<double, 3>;

/// Where the operator's ears are, and which way they face: into the view that the operator looks at.
struct ListenerConfig {
  Vector3 ears_m{0.0, 0.0, 0.8};          ///< in W: the place from which directions are told
  std::optional<percept::ViewNode> view;  ///< until the operator chooses another; none: the main view
  bool follow_viewer = true;              ///< whether the view that the viewer tells of turns the ears
  core::Nanoseconds view_timeout_ns = core::kNsPerSecond;  ///< what it told longer ago does not count
  bool follow_operator = true;  ///< whether the view node that the operator chooses turns the ears
  double main_azimuth_rad =
      0.0;  ///< where the main view's camera stands, seen from the ears: from x towards y
  double main_elevation_rad = 0.0;  ///< above the floor
  double near_m = 0.15;             ///< closer than this a sound comes from all around
};

/// How the ears face: their right, up and backward as unit vectors of W.
using EarAxes = std::array<Vector3, 3>;

/// Into the view from a node, or into the main view if there is none. Real-time safe: yes.
EarAxes ear_axes(const ListenerConfig& listener, std::optional<percept::ViewNode> view) noexcept;

/// `p_W_m` as the ears have it: x right, y up, z backward, metres. Real-time safe: yes.
Vector3 heard_at(const ListenerConfig& listener, const EarAxes& axes, const Vector3& p_W_m) noexcept;

/// Clockwise from straight ahead, seen from above: +90° is right. 0 for a place straight above or below.
/// Real-time safe: yes.
double azimuth_rad(const Vector3& p_ears_m) noexcept;
/// Above the ears' plane. Real-time safe: yes.
double elevation_rad(const Vector3& p_ears_m) noexcept;

}  // namespace phantom::audio_percept
