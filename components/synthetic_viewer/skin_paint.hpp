#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/geometry/mesh.hpp"
#include "components/synthetic_viewer/samples.hpp"

namespace phantom::synthetic_viewer {

/// Closeness in the space around a link, to be looked up where the link's surface is drawn: bytes 0…255 for
/// 0…1 at the middles of cubes, x fastest. In the link's frame.
struct PaintVolume {
  Eigen::Vector3f corner_m = Eigen::Vector3f::Zero();
  float edge_m = 0.0F;               ///< of a cube
  std::array<int, 3> size{0, 0, 0};  ///< cubes along x, y, z; 0: no volume
  std::vector<std::uint8_t> closeness;

  std::uint8_t at(const Eigen::Vector3f& p_L_m) const;  ///< of the cube that holds a place; 0 outside
};

/// The paint of a link from what its patches feel: each patch colours what lies within its edge of it and
/// fades out over as far again, the greatest wins. The volume covers `box` (in the link's frame) with at most
/// 64 cubes a side. An empty box gives no volume. Pure.
PaintVolume paint_link(const geometry::BoundingBox& box, double patch_m,
                       const std::vector<SkinPatchSample>& patches, std::size_t link);

}  // namespace phantom::synthetic_viewer
