#include "ros2_types.h"

#include "ros2_robot.h"

const dds_topic_descriptor_t* const ros2_joint_state = &sensor_msgs_msg_dds__JointState__desc;
const dds_topic_descriptor_t* const ros2_string = &std_msgs_msg_dds__String__desc;
const dds_topic_descriptor_t* const ros2_float64 = &std_msgs_msg_dds__Float64__desc;
const dds_topic_descriptor_t* const ros2_tf = &tf2_msgs_msg_dds__TFMessage__desc;
const dds_topic_descriptor_t* const ros2_diagnostics = &diagnostic_msgs_msg_dds__DiagnosticArray__desc;
const dds_topic_descriptor_t* const ros2_marker = &visualization_msgs_msg_dds__Marker__desc;

const dds_topic_descriptor_t* const ros2_collision_object = &moveit_msgs_msg_dds__CollisionObject__desc;

const dds_topic_descriptor_t* const ros2_twist = &geometry_msgs_msg_dds__TwistStamped__desc;
const dds_topic_descriptor_t* const ros2_joy = &sensor_msgs_msg_dds__Joy__desc;
const dds_topic_descriptor_t* const ros2_cloud = &sensor_msgs_msg_dds__PointCloud2__desc;
const dds_topic_descriptor_t* const ros2_image = &sensor_msgs_msg_dds__Image__desc;
const dds_topic_descriptor_t* const ros2_camera_info = &sensor_msgs_msg_dds__CameraInfo__desc;
const dds_topic_descriptor_t* const ros2_picture = &sensor_msgs_msg_dds__CompressedImage__desc;
const dds_topic_descriptor_t* const ros2_markers = &visualization_msgs_msg_dds__MarkerArray__desc;
const dds_topic_descriptor_t* const ros2_wrench = &geometry_msgs_msg_dds__WrenchStamped__desc;

static dds_topic_descriptor_t named(dds_topic_descriptor_t descriptor) {
  descriptor.m_typename = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";
  return descriptor;
}
dds_topic_descriptor_t ros2_graph_since_iron(void) { return named(iron_ParticipantEntitiesInfo__desc); }
dds_topic_descriptor_t ros2_graph_of_humble(void) { return named(humble_ParticipantEntitiesInfo__desc); }
