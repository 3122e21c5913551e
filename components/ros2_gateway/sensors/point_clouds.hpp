#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"

namespace phantom::ros2_gateway {

/// A sensor_msgs/msg/PointCloud2 as it came; `data` is the message's.
struct CloudMessage {
  struct Field {
    std::string name;
    std::uint32_t offset = 0;
    int datatype = 0;  ///< sensor_msgs/msg/PointField: 7 float32, 8 float64
    std::uint32_t count = 1;
  };
  std::string frame;
  std::uint32_t height = 0, width = 0;
  std::vector<Field> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::span<const std::uint8_t> data;
};

/// A sensor_msgs/msg/Image as it came: a picture, or depths (REP 118).
struct ImageMessage {
  std::string frame;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  bool big_endian = false;
  std::uint32_t step = 0;
  std::span<const std::uint8_t> data;
};

/// What of a sensor_msgs/msg/CameraInfo is used: the camera of the rectified picture.
struct CameraMessage {
  std::string frame;
  std::uint32_t height = 0, width = 0;
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  bool has_region = false;  ///< the picture is a part of the camera's
};
/// A pinhole: a point (X, Y, Z) is seen at column f_x·X/Z + c_x and row f_y·Y/Z + c_y.
struct Pinhole {
  std::string frame;
  std::uint32_t height = 0, width = 0;
  double f_x_px = 0.0, f_y_px = 0.0, c_x_px = 0.0, c_y_px = 0.0;
};

/// Checks that `data` has the rows: `row` octets of each are used.
core::Status check_rows(std::uint64_t row, std::uint64_t step, std::uint64_t height, std::size_t data);

/// Returns the cloud's points in its frame, m, row by row; a point with a number that is none, or farther
/// than 10 km, is one where nothing was measured. Everything is checked before anything is allocated: errors
/// say what is not as the message's definition has it, and what is allowed: fields x, y, z of one float32 or
/// float64 each within point_step, rows of at least width points, data of height rows, at most
/// messages::kMaxSensorPoints points.
core::Expected<messages::SensorPoints> points_of(const CloudMessage& cloud);

/// Returns the camera. Errors: no focal length, binning, a region, sizes beyond kMaxSensorPoints.
core::Expected<Pinhole> pinhole_of(const CameraMessage& camera);

/// Returns an image's depths along z, m, row by row; NaN where nothing was measured. Depths are 16UC1, mm, 0
/// where nothing was measured, or 32FC1, m, NaN or infinite where nothing was. Errors: another encoding, size
/// or frame than the camera's, data that do not hold the rows.
core::Expected<std::vector<float>> depths_of(const ImageMessage& image, const Pinhole& camera);
/// Returns the depths as points in the camera's optical frame (x right, y down, z forward).
core::Expected<messages::SensorPoints> points_of(const ImageMessage& image, const Pinhole& camera);

}  // namespace phantom::ros2_gateway
