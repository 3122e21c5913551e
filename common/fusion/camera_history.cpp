#include "common/fusion/camera_history.hpp"

#include <algorithm>

namespace phantom::fusion {

SeenCells& CameraHistory::of(const DepthHeader& image, std::size_t cells, std::uint32_t frame) {
  for (SeenCells& seen : cameras_) {
    if (seen.least_vox.size() < cells) {
      seen.least_vox.resize(cells);
      seen.greatest_vox.resize(cells);
    }
  }
  const auto is_of_image = [&](const SeenCells& seen) {
    return seen.known && seen.camera == image.camera && seen.X_WC.rotation == image.X_WC.rotation &&
           seen.X_WC.translation_m == image.X_WC.translation_m;
  };
  auto found = std::find_if(cameras_.begin(), cameras_.end(), is_of_image);
  if (found == cameras_.end()) {
    found = std::min_element(cameras_.begin(), cameras_.end(), [](const SeenCells& a, const SeenCells& b) {
      return a.last_frame < b.last_frame;
    });
    found->known = false;
    found->camera = image.camera;
    found->X_WC = image.X_WC;
  }
  found->last_frame = frame;
  return *found;
}

}  // namespace phantom::fusion
