#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fusion/depth_image.hpp"

namespace phantom::fusion {

/// What one camera that stands still saw of late in each cell of its image.
struct SeenCells {
  PinholeCamera camera;
  geometry::Pose X_WC;
  bool known = false;  ///< false: there is nothing to compare with
  std::uint32_t last_frame = 0;
  std::vector<float> least_vox, greatest_vox;
};

/// What up to four cameras saw. A camera is known by its pose and its intrinsics: one that moves is never
/// known. Not thread-safe.
class CameraHistory {
 public:
  /// Returns what the camera of an image saw before; the camera that was not there for longest makes room.
  /// Allocates only for an image of more cells than before.
  SeenCells& of(const DepthHeader& image, std::size_t cells, std::uint32_t frame);

 private:
  std::array<SeenCells, 4> cameras_;
};

}  // namespace phantom::fusion
