#pragma once
// What a page sends of the controller that leads, made by hand after README.md.

#include <cstdint>
#include <cstring>
#include <string>

#include "common/geometry/pose.hpp"

namespace phantom::synthetic_viewer::test {

struct HandMessage {
  std::uint32_t number = 1;
  double page_s = 100.0;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WC = Eigen::Matrix3d::Identity();
  bool tracked = true, grip = false;
  double trigger = 0.0;
};

inline std::string hand_message(const HandMessage& m) {
  std::string octets(44, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(octets.data() + at, &value, sizeof value); };
  const Eigen::Vector4d q = geometry::quaternion_xyzw(m.R_WC);
  put(0, std::uint8_t{3});
  put(1, static_cast<std::uint8_t>((m.tracked ? 1 : 0) | (m.grip ? 2 : 0)));
  put(2, static_cast<std::uint16_t>(m.trigger * 65535));
  put(4, m.number);
  put(8, m.page_s);
  for (int i = 0; i < 3; ++i) put(16 + 4 * static_cast<std::size_t>(i), static_cast<float>(m.position_m[i]));
  for (int i = 0; i < 4; ++i) put(28 + 4 * static_cast<std::size_t>(i), static_cast<float>(q[i]));
  return octets;
}

}  // namespace phantom::synthetic_viewer::test
