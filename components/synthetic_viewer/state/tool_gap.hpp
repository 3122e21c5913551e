#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace phantom::synthetic_viewer {

/// The way from the arm's tool to the nearest object, in W.
struct ToolGap {
  std::uint16_t object = 0;
  Eigen::Vector3d tool_m = Eigen::Vector3d::Zero(), object_m = Eigen::Vector3d::Zero();  ///< its two ends
  double gap_m = 0.0;                                                                    ///< its length
  double object_side_m = 0.0;  ///< least side of the object's box, in the object's frame
};

}  // namespace phantom::synthetic_viewer
