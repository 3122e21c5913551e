#include "components/audio_percept/listener.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace phantom::audio_percept {
namespace {

// From the look-at point to the nodes of the cube around it (fig. 6.22); operator_command numbers them so.
constexpr std::array<std::array<int, 3>, kViewCount> kNodes{{{0, 0, 0},
                                                             {1, 1, 1},
                                                             {-1, 1, 1},
                                                             {-1, -1, 1},
                                                             {1, -1, 1},
                                                             {1, 1, -1},
                                                             {-1, 1, -1},
                                                             {-1, -1, -1},
                                                             {1, -1, -1},
                                                             {0, 1, 0},
                                                             {0, -1, 0},
                                                             {1, 0, 0},
                                                             {-1, 0, 0},
                                                             {0, 0, 1},
                                                             {0, 0, -1}}};

// Unit vector from what is looked at to the camera.
Eigen::Vector3d towards_camera(const ListenerConfig& listener, int view) noexcept {
  if (view != kMainView) {
    const auto& node = kNodes[static_cast<std::size_t>(view)];
    return Eigen::Vector3d(node[0], node[1], node[2]).normalized();
  }
  const double level = std::cos(listener.main_elevation_rad);
  return {level * std::cos(listener.main_azimuth_rad), level * std::sin(listener.main_azimuth_rad),
          std::sin(listener.main_elevation_rad)};
}

}  // namespace

const std::array<const char*, kViewCount> kViewNames{"main", "1", "2", "3", "4", "5", "6", "7",
                                                     "8",    "N", "S", "E", "W", "T", "B"};

Vector3 heard_at(const ListenerConfig& listener, int view, const Vector3& p_W_m) noexcept {
  const Eigen::Vector3d backward = towards_camera(listener, std::clamp(view, 0, kViewCount - 1));
  // As the viewer's cameras: z of W is up, and y where the view is along z.
  const Eigen::Vector3d up_W =
      std::abs(backward.z()) > 0.999 ? Eigen::Vector3d(0, 1, 0) : Eigen::Vector3d(0, 0, 1);
  const Eigen::Vector3d right = up_W.cross(backward).normalized();
  const Eigen::Vector3d up = backward.cross(right);
  const Eigen::Vector3d d = Eigen::Vector3d::Map(p_W_m.data()) - Eigen::Vector3d::Map(listener.ears_m.data());
  return {right.dot(d), up.dot(d), backward.dot(d)};
}

double azimuth_rad(const Vector3& p) noexcept {
  return std::hypot(p[0], p[2]) < 1e-9 ? 0.0 : std::atan2(p[0], -p[2]);
}

double elevation_rad(const Vector3& p) noexcept { return std::atan2(p[1], std::hypot(p[0], p[2])); }

}  // namespace phantom::audio_percept
