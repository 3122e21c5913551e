#include "components/audio_percept/listener.hpp"

#include <Eigen/Core>
#include <cmath>

namespace phantom::audio_percept {

Vector3 heard_at(const ListenerConfig& listener, std::optional<percept::ViewNode> view,
                 const Vector3& p_W_m) noexcept {
  const Eigen::Vector3d backward =
      view ? percept::node_direction(*view)
           : percept::direction_at(listener.main_azimuth_rad, listener.main_elevation_rad);
  const Eigen::Vector3d d = Eigen::Vector3d::Map(p_W_m.data()) - Eigen::Vector3d::Map(listener.ears_m.data());
  Vector3 heard;
  Eigen::Vector3d::Map(heard.data()) = percept::view_axes(backward) * d;
  return heard;
}

double azimuth_rad(const Vector3& p) noexcept {
  return std::hypot(p[0], p[2]) < 1e-9 ? 0.0 : std::atan2(p[0], -p[2]);
}

double elevation_rad(const Vector3& p) noexcept { return std::atan2(p[1], std::hypot(p[0], p[2])); }

}  // namespace phantom::audio_percept
