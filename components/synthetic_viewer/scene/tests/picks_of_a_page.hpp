#pragma once
// Picks as a person would click them who sees a camera's picture without its distortion.

#include <algorithm>
#include <string>
#include <vector>

#include "common/runtime/cell/cell_bodies.hpp"
#include "components/synthetic_viewer/scene/pose_calibration.hpp"

namespace phantom::synthetic_viewer::test {

/// All known corners of a cell's objects.
inline std::vector<KnownCorner> corners_of(const runtime::CellConfig& cell) {
  std::vector<KnownCorner> corners;
  for (const runtime::CellBody& body : runtime::load_bodies(cell)) {
    const runtime::ObjectConfig& object = cell.objects[body.body.id - 1U];
    add_known_corners(object.name, object.X_WO, edges_of(body.mesh_O), corners);
  }
  return corners;
}

/// Where a camera that really stands at X_WS sees a point: shares of the picture's width and height.
inline Eigen::Vector2d share_at(const VideoCamera& camera, int width_px, int height_px,
                                const geometry::Pose& X_WS, const Eigen::Vector3d& position_W_m) {
  const camera::LensModel straight(
      camera::straightened(camera::LensModel(*camera.calibration.lens), width_px, height_px));
  const auto pixel = straight.project(X_WS.inverse() * position_W_m);
  if (!pixel) return {-1.0, -1.0};
  return {(pixel->x() + 0.5) / width_px, (pixel->y() + 0.5) / height_px};
}

}  // namespace phantom::synthetic_viewer::test
