#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "components/synthetic_viewer/samples/samples.hpp"

namespace phantom::synthetic_viewer {

/// Closeness in the space around a link, sampled where the link's surface is drawn. Bytes 0…255 stand for 0…1
/// at the centres of cubes, x fastest. In the link's frame.
struct PaintVolume {
  Eigen::Vector3f corner_m = Eigen::Vector3f::Zero();
  float edge_m = 0.0F;               ///< edge length of a cube
  std::array<int, 3> size{0, 0, 0};  ///< cubes along x, y, z; 0: no volume
  std::vector<std::uint8_t> closeness;
};

/// Returns the paint of a link from what its patches feel. Each patch colours everything within its edge
/// length and fades out over the same length again; the greatest value wins. The volume covers `box` (in the
/// link's frame) with at most 64 cubes a side. An empty box gives no volume. Pure.
PaintVolume paint_link(const geometry::BoundingBox& box, double patch_m,
                       const std::vector<SkinPatchSample>& patches, std::size_t link);

}  // namespace phantom::synthetic_viewer
