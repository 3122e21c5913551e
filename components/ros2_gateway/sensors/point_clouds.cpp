#include "components/ros2_gateway/sensors/point_clouds.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace phantom::ros2_gateway {
namespace {

constexpr int kFloat32 = 7, kFloat64 = 8;  // sensor_msgs/msg/PointField
constexpr float kFarthest_m = 1e4F;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

core::Status invalid(const std::string& why) { return core::Status::invalid_argument(why); }
std::string text(std::uint64_t number) { return std::to_string(number); }

template <class T>
T read(const std::uint8_t* from, bool big_endian) {
  std::array<std::uint8_t, sizeof(T)> octets;
  std::copy_n(from, sizeof(T), octets.begin());
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(octets.begin(), octets.end());
  return std::bit_cast<T>(octets);
}

core::Status check_size(std::uint64_t width, std::uint64_t height) {
  if (width * height == 0 || width * height > messages::kMaxSensorPoints)
    return invalid(text(width) + " x " + text(height) + " points; allowed: 1 to " +
                   text(messages::kMaxSensorPoints));
  return core::Status::ok();
}

core::Status check_frame(const std::string& frame) {
  if (frame.empty() || frame.size() > messages::kMaxFrame)
    return invalid("frame_id has " + text(frame.size()) + " octets; allowed: 1 to " +
                   text(messages::kMaxFrame));
  return core::Status::ok();
}

/// Sets a point, or says that there is none.
void put(float* to, double x, double y, double z) {
  const std::array<float, 3> p{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  const bool there =
      std::all_of(p.begin(), p.end(), [](float value) { return std::abs(value) <= kFarthest_m; });
  for (std::size_t i = 0; i < 3; ++i) to[i] = there ? p[i] : kNone;
}

/// Where a coordinate lies in a point.
struct Coordinate {
  std::uint32_t offset = 0;
  bool is_double = false;
  double of(const std::uint8_t* point, bool big_endian) const {
    return is_double ? read<double>(point + offset, big_endian)
                     : static_cast<double>(read<float>(point + offset, big_endian));
  }
};

core::Expected<Coordinate> coordinate(const CloudMessage& cloud, const char* name) {
  const auto is_it = [name](const CloudMessage::Field& field) { return field.name == name; };
  const auto found = std::find_if(cloud.fields.begin(), cloud.fields.end(), is_it);
  if (found == cloud.fields.end()) return invalid(std::string("no field ") + name + "; needed: x, y, z");
  const bool is_double = found->datatype == kFloat64;
  if ((found->datatype != kFloat32 && !is_double) || found->count > 1)
    return invalid(std::string("field ") + name + " has datatype " + std::to_string(found->datatype) +
                   ", count " + text(found->count) + "; allowed: 7 (float32) or 8 (float64), once");
  if (std::uint64_t{found->offset} + (is_double ? 8 : 4) > cloud.point_step)
    return invalid(std::string("field ") + name + " lies beyond point_step " + text(cloud.point_step));
  return Coordinate{found->offset, is_double};
}

messages::SensorPoints empty_points(const std::string& frame, std::uint32_t width, std::uint32_t height) {
  messages::SensorPoints points;
  points.frame = frame;
  points.width = width;
  points.height = height;
  points.xyz_m.resize(std::size_t{3} * width * height);
  return points;
}

}  // namespace

core::Status check_rows(std::uint64_t row, std::uint64_t step, std::uint64_t height, std::size_t data) {
  if (step < row) return invalid("a row has " + text(step) + " octets; allowed: at least " + text(row));
  if (data != step * height)
    return invalid("data has " + text(data) + " octets; allowed: " + text(step * height) + ", the rows'");
  return core::Status::ok();
}

core::Expected<messages::SensorPoints> points_of(const CloudMessage& cloud) {
  core::Status status = check_frame(cloud.frame);
  if (status) status = check_size(cloud.width, cloud.height);
  if (status)
    status = check_rows(std::uint64_t{cloud.width} * cloud.point_step, cloud.row_step, cloud.height,
                        cloud.data.size());
  if (!status) return status;
  std::array<Coordinate, 3> at;
  for (std::size_t i = 0; i < 3; ++i) {
    constexpr std::array kNames{"x", "y", "z"};
    const auto found = coordinate(cloud, kNames[i]);
    if (!found) return found.status();
    at[i] = *found;
  }
  messages::SensorPoints points = empty_points(cloud.frame, cloud.width, cloud.height);
  float* to = points.xyz_m.data();
  for (std::size_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* point = cloud.data.data() + row * cloud.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, point += cloud.point_step, to += 3)
      put(to, at[0].of(point, cloud.big_endian), at[1].of(point, cloud.big_endian),
          at[2].of(point, cloud.big_endian));
  }
  return points;
}

core::Expected<Pinhole> pinhole_of(const CameraMessage& camera) {
  core::Status status = check_frame(camera.frame);
  if (status) status = check_size(camera.width, camera.height);
  if (!status) return status;
  if (camera.binning_x > 1 || camera.binning_y > 1 || camera.has_region)
    return invalid("the picture is binned or a region of the camera's; allowed: the whole picture");
  const auto& p = camera.p;
  if (!std::all_of(p.begin(), p.end(), [](double value) { return std::isfinite(value); }) || !(p[0] > 0.0) ||
      !(p[5] > 0.0) || p[1] != 0.0 || p[10] != 1.0)
    return invalid("p is not the matrix of a rectified camera; allowed: focal lengths above 0, no skew");
  return Pinhole{camera.frame, camera.height, camera.width, p[0], p[5], p[2], p[6]};
}

core::Expected<std::vector<float>> depths_of(const ImageMessage& image, const Pinhole& camera) {
  const bool in_mm = image.encoding == "16UC1";
  if (!in_mm && image.encoding != "32FC1")
    return invalid("encoding is '" + image.encoding.substr(0, 32) + "'; allowed: 16UC1 (mm), 32FC1 (m)");
  core::Status status = check_size(image.width, image.height);
  if (status && (image.frame != camera.frame || image.width != camera.width || image.height != camera.height))
    status = invalid("frame or size are not those of the camera_info");
  if (status)
    status =
        check_rows(std::uint64_t{image.width} * (in_mm ? 2 : 4), image.step, image.height, image.data.size());
  if (!status) return status;
  std::vector<float> depths_m(std::size_t{image.width} * image.height);
  float* to = depths_m.data();
  for (std::size_t row = 0; row < image.height; ++row) {
    const std::uint8_t* depth = image.data.data() + row * image.step;
    for (std::size_t column = 0; column < image.width; ++column, depth += in_mm ? 2 : 4, ++to) {
      const float z_m = in_mm ? 1e-3F * static_cast<float>(read<std::uint16_t>(depth, image.big_endian))
                              : read<float>(depth, image.big_endian);
      *to = z_m > 0.0F && z_m <= kFarthest_m ? z_m : kNone;
    }
  }
  return depths_m;
}

core::Expected<messages::SensorPoints> points_of(const ImageMessage& image, const Pinhole& camera) {
  const auto depths_m = depths_of(image, camera);
  if (!depths_m) return depths_m.status();
  messages::SensorPoints points = empty_points(image.frame, image.width, image.height);
  float* to = points.xyz_m.data();
  for (std::size_t i = 0; i < depths_m->size(); ++i, to += 3) {
    const double z_m = (*depths_m)[i], column = static_cast<double>(i % image.width),
                 row = static_cast<double>(i / image.width);
    put(to, (column - camera.c_x_px) * z_m / camera.f_x_px, (row - camera.c_y_px) * z_m / camera.f_y_px, z_m);
  }
  return points;
}

}  // namespace phantom::ros2_gateway
