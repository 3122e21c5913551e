#include "components/ros2_gateway/sensors/depth_images.hpp"

#include "common/fusion/point_projection.hpp"
#include "common/messages/living.hpp"

namespace phantom::ros2_gateway {
namespace {

core::Expected<messages::DepthImage> empty_image(const Pinhole& camera, const DepthRange& range) {
  constexpr auto kMaxEdge = static_cast<std::uint32_t>(fusion::kMaxImageEdge_px);
  if (camera.width > kMaxEdge || camera.height > kMaxEdge)
    return core::Status::invalid_argument(std::to_string(camera.width) + " x " +
                                          std::to_string(camera.height) + " pixels; allowed: at most " +
                                          std::to_string(kMaxEdge) + " each");
  const std::uint64_t pixels = std::uint64_t{camera.width} * camera.height;
  if (pixels > messages::kMaxDepthPixels)
    return core::Status::invalid_argument(std::to_string(pixels) + " pixels; allowed: at most " +
                                          std::to_string(messages::kMaxDepthPixels));
  messages::DepthImage image;
  image.width = camera.width;
  image.height = camera.height;
  image.fx_px = camera.f_x_px;
  image.fy_px = camera.f_y_px;
  image.cx_px = camera.c_x_px;
  image.cy_px = camera.c_y_px;
  image.min_depth_m = range.min_m;
  image.max_depth_m = range.max_m;
  image.depth_mm.resize(pixels);
  return image;
}

}  // namespace

core::Expected<messages::DepthImage> depth_image_of(const ImageMessage& image, const Pinhole& camera,
                                                    const DepthRange& range) {
  auto made = empty_image(camera, range);
  if (!made) return made;
  const auto depths_m = depths_of(image, camera);
  if (!depths_m) return depths_m.status();
  for (std::size_t i = 0; i < depths_m->size(); ++i)
    made->depth_mm[i] = fusion::whole_mm(static_cast<double>((*depths_m)[i]));
  return made;
}

core::Expected<messages::DepthImage> depth_image_of(const CloudMessage& cloud, const Pinhole& camera,
                                                    const DepthRange& range) {
  if (cloud.frame != camera.frame)
    return core::Status::invalid_argument("the cloud is in frame '" + cloud.frame.substr(0, 64) +
                                          "'; allowed: its camera's, '" + camera.frame + "'");
  auto made = empty_image(camera, range);
  if (!made) return made;
  const auto points = points_of(cloud);
  if (!points) return points.status();
  const fusion::PinholeCamera pinhole{static_cast<int>(camera.width),
                                      static_cast<int>(camera.height),
                                      camera.f_x_px,
                                      camera.f_y_px,
                                      camera.c_x_px,
                                      camera.c_y_px,
                                      range.min_m,
                                      range.max_m};
  made->depth_mm = fusion::depths_of_points(points->xyz_m, pinhole);
  return made;
}

}  // namespace phantom::ros2_gateway
