#include "components/audio_percept/listener.hpp"

#include <Eigen/Core>
#include <cmath>

namespace phantom::audio_percept {

ListenerAxes listener_axes(const ListenerConfig& listener, std::optional<percept::ViewNode> view) noexcept {
  const Eigen::Matrix3d rows = percept::view_axes(
      view ? percept::node_direction(*view)
           : percept::direction_at(listener.main_azimuth_rad, listener.main_elevation_rad));
  ListenerAxes axes;
  for (std::size_t i = 0; i < axes.size(); ++i)
    Eigen::Vector3d::Map(axes[i].data()) = rows.row(static_cast<Eigen::Index>(i));
  return axes;
}

Vector3 in_listener_frame(const ListenerConfig& listener, const ListenerAxes& axes,
                          const Vector3& p_W_m) noexcept {
  const Eigen::Vector3d d =
      Eigen::Vector3d::Map(p_W_m.data()) - Eigen::Vector3d::Map(listener.position_m.data());
  Vector3 heard;
  for (std::size_t i = 0; i < axes.size(); ++i) heard[i] = Eigen::Vector3d::Map(axes[i].data()).dot(d);
  return heard;
}

double azimuth_rad(const Vector3& p) noexcept {
  return std::hypot(p[0], p[2]) < 1e-9 ? 0.0 : std::atan2(p[0], -p[2]);
}

double elevation_rad(const Vector3& p) noexcept { return std::atan2(p[1], std::hypot(p[0], p[2])); }

}  // namespace phantom::audio_percept
