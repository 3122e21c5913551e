#include "components/ros2_gateway/sensors/dds_adapter_clouds.hpp"

namespace phantom::ros2_gateway {

CloudMessage message_of(const sensor_msgs::msg::dds_::PointCloud2_& from) {
  CloudMessage cloud;
  cloud.frame = from.header().frame_id();
  cloud.height = from.height();
  cloud.width = from.width();
  for (const auto& field : from.fields())
    cloud.fields.push_back({field.name(), field.offset(), field.datatype(), field.count()});
  cloud.big_endian = from.is_bigendian();
  cloud.point_step = from.point_step();
  cloud.row_step = from.row_step();
  cloud.data = from.data();
  return cloud;
}

CameraMessage message_of(const sensor_msgs::msg::dds_::CameraInfo_& from) {
  const auto& roi = from.roi();
  const bool part = roi.x_offset() != 0 || roi.y_offset() != 0 ||
                    (roi.width() != 0 && roi.width() != from.width()) ||
                    (roi.height() != 0 && roi.height() != from.height());
  return {from.header().frame_id(), from.height(),    from.width(), from.p(),
          from.binning_x(),         from.binning_y(), part};
}

}  // namespace phantom::ros2_gateway
