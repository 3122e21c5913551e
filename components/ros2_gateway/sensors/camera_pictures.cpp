#include "components/ros2_gateway/sensors/camera_pictures.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/pictures/picture_head.hpp"

namespace phantom::ros2_gateway {
namespace {

core::Status not_taken(const std::string& why) { return core::Status::invalid_argument(why); }

core::Status check_picture_size(std::uint64_t width, std::uint64_t height) {
  using namespace messages;
  const auto side = [](std::uint64_t px) { return px >= kMinPictureSide_px && px <= kMaxPictureSide_px; };
  if (side(width) && side(height) && width * height <= kMaxPicturePixels) return core::Status::ok();
  return not_taken("has " + std::to_string(width) + " x " + std::to_string(height) +
                   " px; allowed: 16 to 8192 each, 16777216 in all");
}

/// `pixels`: CV_8UC3 (blue, green, red) or CV_8UC1, of a size that was checked.
core::Expected<messages::CameraPicture> encoded(const cv::Mat& pixels, int jpeg_quality) {
  messages::CameraPicture picture;
  picture.width = static_cast<std::uint32_t>(pixels.cols);
  picture.height = static_cast<std::uint32_t>(pixels.rows);
  try {
    cv::imencode(".jpg", pixels, picture.jpeg, {cv::IMWRITE_JPEG_QUALITY, jpeg_quality});
  } catch (const cv::Exception&) {
    picture.jpeg.clear();
  }
  if (picture.jpeg.empty()) return not_taken("cannot be encoded as JPEG");
  if (picture.jpeg.size() > messages::kMaxPictureBytes)
    return not_taken("has " + std::to_string(picture.jpeg.size()) + " octets as JPEG; allowed: " +
                     std::to_string(messages::kMaxPictureBytes) + ". Lower camera.jpeg_quality");
  return picture;
}

}  // namespace

core::Expected<messages::CameraPicture> picture_of(const ImageMessage& image, int jpeg_quality) {
  const bool grey = image.encoding == "mono8", rgb = image.encoding == "rgb8";
  if (!grey && !rgb && image.encoding != "bgr8")
    return not_taken("encoding is '" + image.encoding.substr(0, 32) + "'; allowed: rgb8, bgr8, mono8");
  core::Status status = check_picture_size(image.width, image.height);
  if (status)
    status =
        check_rows(std::uint64_t{image.width} * (grey ? 1 : 3), image.step, image.height, image.data.size());
  if (!status) return status;
  // OpenCV does not write to its input.
  const cv::Mat sent(static_cast<int>(image.height), static_cast<int>(image.width), grey ? CV_8UC1 : CV_8UC3,
                     const_cast<std::uint8_t*>(image.data.data()), image.step);
  cv::Mat pixels = sent;
  if (rgb) cv::cvtColor(sent, pixels, cv::COLOR_RGB2BGR);
  return encoded(pixels, jpeg_quality);
}

core::Expected<messages::CameraPicture> picture_of(const CompressedMessage& image, int jpeg_quality) {
  const auto head = pictures::picture_head(image.data);
  if (!head)
    return not_taken("data are neither JPEG nor PNG; format is '" + image.format.substr(0, 32) + "'");
  const core::Status status = check_picture_size(static_cast<std::uint64_t>(head->width_px),
                                                 static_cast<std::uint64_t>(head->height_px));
  if (!status) return status;
  if (head->kind == pictures::PictureKind::kJpeg) {
    if (image.data.size() > messages::kMaxPictureBytes)
      return not_taken("has " + std::to_string(image.data.size()) +
                       " octets; allowed: " + std::to_string(messages::kMaxPictureBytes));
    messages::CameraPicture picture;
    picture.width = static_cast<std::uint32_t>(head->width_px);
    picture.height = static_cast<std::uint32_t>(head->height_px);
    picture.jpeg.assign(image.data.begin(), image.data.end());
    return picture;
  }
  const cv::Mat octets(1, static_cast<int>(image.data.size()), CV_8UC1,
                       const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat pixels;
  try {
    pixels = cv::imdecode(octets, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    pixels.release();
  }
  if (pixels.cols != head->width_px || pixels.rows != head->height_px) return not_taken("PNG is damaged");
  return encoded(pixels, jpeg_quality);
}

}  // namespace phantom::ros2_gateway
