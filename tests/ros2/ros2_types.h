#pragma once

#include <dds/dds.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Descriptors of the types as Cyclone DDS has them; the graph's have the names of the wire. */
extern const dds_topic_descriptor_t *const ros2_joint_state, *const ros2_string, *const ros2_float64, *const ros2_tf,
    *const ros2_diagnostics, *const ros2_marker, *const ros2_collision_object,
    *const ros2_wrench, *const ros2_twist, *const ros2_joy, *const ros2_cloud, *const ros2_image, *const ros2_camera_info,
    *const ros2_picture, *const ros2_markers;
dds_topic_descriptor_t ros2_graph_since_iron(void);
dds_topic_descriptor_t ros2_graph_of_humble(void);

#ifdef __cplusplus
}
#endif
