#pragma once

#include "components/ros2_gateway/sensors/point_clouds.hpp"

namespace phantom::ros2_gateway {

/// Depths that a camera can measure.
struct DepthRange {
  double min_m = 0.2, max_m = 5.0;
};

/// Returns an image of depths as depth_image, whole millimetres; its camera's name and age are left open.
/// Errors: those of depths_of(); more pixels than messages::kMaxDepthPixels.
core::Expected<messages::DepthImage> depth_image_of(const ImageMessage& image, const Pinhole& camera,
                                                    const DepthRange& range);

/// Returns a cloud as the depths that its camera sees: each point in the pixel that its ray passes, of
/// several the nearest; points beside the image or behind the camera are left out. Errors: those of
/// points_of(); a cloud that is not in the camera's optical frame; more pixels than allowed.
core::Expected<messages::DepthImage> depth_image_of(const CloudMessage& cloud, const Pinhole& camera,
                                                    const DepthRange& range);

}  // namespace phantom::ros2_gateway
