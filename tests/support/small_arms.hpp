#pragma once

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::test {

/// A forearm of 0.5 m that an elbow turns about z.
inline robot::SerialArm one_joint() {
  const std::vector<robot::DhRow> rows{{.link = "forearm",
                                        .joint = "elbow",
                                        .a_m = 0.5,
                                        .lower = -2.0,
                                        .upper = 2.0,
                                        .max_speed = 2.0,
                                        .max_effort = 50.0}};
  return robot::SerialArm::from_dh(rows, robot::DhConvention::kClassic, {}).value();
}

/// Six turning joints, as many an industrial arm has them.
inline robot::SerialArm six_joints() {
  std::vector<robot::DhRow> rows;
  const double a_m[] = {0.1, 0.6, 0.05, 0, 0, 0}, d_m[] = {0.4, 0, 0, 0.5, 0, 0.1};
  const double alpha[] = {M_PI / 2, 0, M_PI / 2, -M_PI / 2, M_PI / 2, 0};
  for (std::size_t j = 0; j < 6; ++j)
    rows.push_back({.link = "l" + std::to_string(j),
                    .joint = "j" + std::to_string(j),
                    .d_m = d_m[j],
                    .a_m = a_m[j],
                    .alpha_rad = alpha[j],
                    .lower = -3.0,
                    .upper = 3.0,
                    .max_speed = 2.0,
                    .max_effort = 50.0});
  return robot::SerialArm::from_dh(rows, robot::DhConvention::kClassic, {}).value();
}

}  // namespace phantom::test
